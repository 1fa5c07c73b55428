// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/filter.h"

#include <algorithm>
#include <string>
#include <utility>

#include "alidade/base/error.h"
#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/estimation/filter_engine.h"

namespace alidade {

using internal::FilterEngine;

namespace {

[[noreturn]] void ThrowUnknownName(const char* kind, std::string_view name,
                                   const std::vector<std::string>& names) {
  throw Error(ExitCode::kBadConfig, "the problem has no " + std::string(kind) + " '" +
                                        std::string(name) + "'; expected one of " +
                                        internal::Join(names));
}

void CheckKnown(const std::string& place, int size, const std::vector<double>& known) {
  if (std::ssize(known) == size) return;
  throw Error(ExitCode::kBadData, place + ": the number of known numbers of a measurement is " +
                                      std::to_string(known.size()) + "; expected " +
                                      std::to_string(size));
}

/// Returns the index of the sensor. Throws an Error if the sensor does not exist, or if the size of
/// `known` differs from the number of known numbers that its model needs.
int FindSensor(const Problem& problem, std::string_view name, const std::vector<double>& known) {
  const int index = problem.FindSensor(name);
  if (index < 0) ThrowUnknownName("sensor", name, internal::NamesOf(problem.sensors));
  CheckKnown("sensor '" + std::string(name) + '\'',
             problem.sensors[static_cast<std::size_t>(index)].model->known_size(), known);
  return index;
}

void CheckReading(const std::vector<StreamInfo>& streams, const Problem& problem,
                  const Reading& reading) {
  if (reading.stream < 0 || reading.stream >= std::ssize(streams)) {
    throw Error(ExitCode::kBadData,
                reading.stream < 0
                    ? "a reading has no stream; expected a sensor, or a state with a control input"
                    : "a reading has the stream index " + std::to_string(reading.stream) +
                          "; expected an index below " + std::to_string(streams.size()));
  }
  const StreamInfo& stream = streams[static_cast<std::size_t>(reading.stream)];
  if (std::ssize(reading.values) != stream.size) {
    throw Error(ExitCode::kBadData, "stream '" + stream.name +
                                        "': the number of values of a measurement is " +
                                        std::to_string(reading.values.size()) + "; expected " +
                                        std::to_string(stream.size));
  }
  CheckKnown("stream '" + stream.name + '\'', stream.known, reading.known);
  for (const SensorBinding& sensor : problem.sensors) {
    if (sensor.stream != stream.name) continue;
    const Geometry& geometry = sensor.model->measurement().geometry;
    const double defect = DistanceFrom(geometry, reading.values.data());
    if (defect > kUnitTolerance) {
      throw Error(ExitCode::kBadData, "stream '" + stream.name +
                                          "': the length of the values differs from 1 by " +
                                          internal::RoundedText(defect, 4) +
                                          "; expected a unit vector or unit quaternion");
    }
    const int m = geometry.tangent;
    if (reading.covariance.empty() || std::ssize(reading.covariance) == m * m) continue;
    throw Error(ExitCode::kBadData, "stream '" + stream.name +
                                        "': the number of covariance elements is " +
                                        std::to_string(reading.covariance.size()) + "; expected " +
                                        std::to_string(m * m));
  }
}

}  // namespace

Filter::Filter(Problem problem, const EkfOptions& options, const std::vector<StreamInfo>& streams,
               std::unique_ptr<internal::UpdateMethod> method)
    : engine_(std::make_unique<FilterEngine>(std::move(problem), options, streams,
                                             std::move(method))) {}

void Filter::Start(Timestamp timestamp) { engine_->f.timestamp = timestamp; }

const UpdateReport& Filter::Process(const Frame& frame) {
  engine_->Process(frame);
  return engine_->f.report;
}

const Problem& Filter::problem() const { return engine_->f.problem_index->problem; }
const State& Filter::state() const { return engine_->f.state; }
Timestamp Filter::timestamp() const { return engine_->f.timestamp; }
bool Filter::diverged() const { return engine_->f.health.diverged; }
bool Filter::failed() const { return engine_->f.health.ended; }

std::vector<LandmarkEstimate> Filter::landmarks() const {
  if (!engine_->landmarks) return {};
  return engine_->landmarks->Estimates(engine_->f.state);
}

int Filter::stream(std::string_view name) const {
  const std::vector<StreamInfo>& streams = engine_->f.problem_index->streams;
  const auto found = std::ranges::find(streams, name, &StreamInfo::name);
  if (found == streams.end()) ThrowUnknownName("stream", name, internal::NamesOf(streams));
  return static_cast<int>(found - streams.begin());
}

BlockId Filter::block(std::string_view name) const {
  const BlockId id = problem().layout.Find(name);
  if (id < 0) ThrowUnknownName("block", name, internal::NamesOf(problem().layout.blocks()));
  return id;
}

Frame Filter::MakeFrame(Timestamp timestamp, const std::vector<Reading>& readings) const {
  Frame frame;
  frame.timestamp = timestamp;
  for (const Reading& reading : readings) {
    CheckReading(engine_->f.problem_index->streams, problem(), reading);
    frame.measurements.push_back({timestamp, reading.stream, reading.landmark, reading.values,
                                  reading.covariance, reading.known});
  }
  return frame;
}

const UpdateReport& Filter::Push(Timestamp timestamp, const std::vector<Reading>& readings) {
  return Process(MakeFrame(timestamp, readings));
}

BlockEstimate Filter::Estimate(BlockId id) const { return state().Estimate(id); }

State Filter::At(Timestamp timestamp) const {
  FilterEngine later(*engine_);
  later.Process({timestamp, {}});
  return std::move(later.f.state);
}

std::optional<Prediction> Filter::Expect(std::string_view sensor, Timestamp timestamp,
                                         std::int64_t landmark,
                                         const std::vector<double>& known) const {
  const int index = FindSensor(problem(), sensor, known);
  FilterEngine later(*engine_);
  later.Process({timestamp, {}});
  return later.Expect(index, landmark, known);
}

std::vector<std::optional<Prediction>> Filter::ExpectEach(
    std::string_view sensor, Timestamp timestamp,
    const std::vector<std::int64_t>& landmarks) const {
  const int index = FindSensor(problem(), sensor, {});
  std::vector<std::optional<Prediction>> predictions;
  if (landmarks.empty()) return predictions;
  FilterEngine later(*engine_);
  later.Process({timestamp, {}});
  for (const std::int64_t landmark : landmarks) {
    predictions.push_back(later.Expect(index, landmark, {}));
  }
  return predictions;
}

}  // namespace alidade
