// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/frame_check.h"

#include <algorithm>
#include <iterator>
#include <span>

#include "alidade/base/number_text.h"
#include "alidade/experiment/truth_match.h"
#include "alidade/state/quaternion_sign.h"

namespace alidade::internal {
namespace {

constexpr double kCountedDefect = 1e-9;

/// Returns the name of a geometry for a sentence, such as `unit quaternion`.
std::string SpacedName(const Geometry& geometry) {
  std::string name = geometry.name();
  std::ranges::replace(name, '_', ' ');
  return name;
}

[[noreturn]] void Reject(const Frame& frame, const std::string& defect) {
  throw ContractViolation("the source returned " + defect +
                          " at t = " + SecondsText(frame.timestamp));
}

void CheckSize(const Frame& frame, const StreamInfo& info, const std::vector<double>& values) {
  if (std::ssize(values) == info.size) return;
  Reject(frame, std::to_string(values.size()) + " values of '" + info.name + "', not " +
                    std::to_string(info.size) + ',');
}

/// Returns the geometry that the models of the experiment assign to a stream; a vector if no model
/// reads the stream.
Geometry GeometryOf(const Experiment& experiment, const StreamInfo& stream) {
  for (const EstimatorSpec& spec : experiment.estimators) {
    for (const SensorBinding& sensor : spec.problem.sensors) {
      if (sensor.stream == stream.name) return sensor.model->measurement().geometry;
    }
    for (const MotionBinding& motion : spec.problem.motions) {
      if (motion.input.stream == stream.name) return motion.model->input().geometry;
    }
  }
  return Geometry::Vector(stream.size);
}

}  // namespace

FrameCheck::FrameCheck(const Experiment& experiment, Counts& normalised)
    : source_(*experiment.source), normalised_(normalised) {
  for (const StreamInfo& stream : source_.streams()) {
    streams_.push_back({stream, GeometryOf(experiment, stream)});
  }
  const std::vector<StreamInfo>& truths = source_.truths();
  for (const StreamInfo& truth : truths) {
    truths_.push_back({truth, Geometry::Vector(truth.size)});
  }
  for (const EstimatorSpec& spec : experiment.estimators) {
    const std::vector<int> match = MatchTruths(spec.problem.layout, truths);
    for (std::size_t block = 0; block < match.size(); ++block) {
      if (match[block] < 0) continue;
      truths_[static_cast<std::size_t>(match[block])].geometry =
          spec.problem.layout.blocks()[block].geometry();
    }
  }
}

void FrameCheck::operator()(SourceFrame& frame) {
  Check(frame);
  for (Measurement& m : frame.measurements) {
    Normalise(streams_[static_cast<std::size_t>(m.stream)], m.values);
  }
  for (std::size_t t = 0; t < frame.truth.size(); ++t) {
    if (!frame.truth[t].empty()) Normalise(truths_[t], frame.truth[t]);
  }
}

void FrameCheck::Check(const SourceFrame& frame) const {
  for (const Measurement& m : frame.measurements) {
    if (m.stream < 0 || m.stream >= std::ssize(streams_)) {
      Reject(frame, "a measurement with stream index " + std::to_string(m.stream) +
                        ", although the number of streams is " + std::to_string(streams_.size()) +
                        ',');
    }
    const Channel& channel = streams_[static_cast<std::size_t>(m.stream)];
    CheckSize(frame, channel.info, m.values);
    if (std::ssize(m.known) != channel.info.known) {
      Reject(frame, std::to_string(m.known.size()) + " known numbers with '" + channel.info.name +
                        "', not " + std::to_string(channel.info.known) + ',');
    }
    const int tangent = channel.geometry.tangent;
    if (!m.covariance.empty() && std::ssize(m.covariance) != tangent * tangent) {
      const std::string rows = std::to_string(tangent);
      throw Error(ExitCode::kBadData,
                  ErrorLine(source_.place(), channel.info.name,
                            "the covariance has " + std::to_string(m.covariance.size()) +
                                " numbers, but the measurement has " + rows +
                                (tangent == 1 ? " degree" : " degrees") + " of freedom",
                            "a covariance of " + rows + " x " + rows));
    }
  }
  if (frame.truth.size() > truths_.size()) {
    Reject(frame, std::to_string(frame.truth.size()) +
                      " truths, although the number of truths is " +
                      std::to_string(truths_.size()) + ',');
  }
  for (std::size_t t = 0; t < frame.truth.size(); ++t) {
    if (!frame.truth[t].empty()) CheckSize(frame, truths_[t].info, frame.truth[t]);
  }
}

void FrameCheck::Normalise(Channel& channel, std::vector<double>& value) {
  channel.geometry.ForEachPart([&](const Geometry& part, int a, int) {
    if (part.row().distance == nullptr) return;
    double* const x = value.data() + a;
    const double defect = DistanceFrom(part, x);
    if (!(defect <= kUnitTolerance)) {
      throw Error(ExitCode::kBadData, ErrorLine(source_.place(), channel.info.name,
                                                "the length of a " + SpacedName(part) +
                                                    " differs from 1 by " + RoundedText(defect, 4),
                                                "a length within 1e-3 of 1"));
    }
    if (defect > kCountedDefect) ++normalised_[channel.info.name];
    part.Normalise(x);
    if (part.row().quaternion >= 0) ChooseSign({}, {x + part.row().quaternion, 4});
  });
}

void FrameCheck::ChooseTruthSigns(SourceFrame& frame) {
  for (std::size_t t = 0; t < frame.truth.size(); ++t) {
    Channel& channel = truths_[t];
    const int first = channel.geometry.row().quaternion;
    if (frame.truth[t].empty() || first < 0) continue;
    const auto q = std::span(frame.truth[t]).subspan(static_cast<std::size_t>(first), 4);
    ChooseSign(channel.previous, q);
    channel.previous.assign(q.begin(), q.end());
  }
}

}  // namespace alidade::internal
