// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/source_files.h"

#include <algorithm>
#include <map>
#include <set>

#include "alidade/experiment/truth_match.h"
#include "alidade/state/element_names.h"

namespace alidade::internal {
namespace {

/// Returns the columns of truth.csv, by truth and element.
std::vector<std::vector<std::string>> TruthColumns(const Experiment& experiment) {
  const std::vector<StreamInfo>& truths = experiment.source->truths();
  std::vector<std::vector<std::string>> columns;
  for (std::size_t t = 0; t < truths.size(); ++t) {
    std::vector<std::string> names = NumberedNames(truths[t].name, truths[t].size);
    // The names of the elements are those of the first state that has this block.
    for (const EstimatorSpec& spec : experiment.estimators) {
      const StateLayout& layout = spec.problem.layout;
      const std::vector<int> match = MatchTruths(layout, truths);
      const auto block = std::find(match.begin(), match.end(), static_cast<int>(t));
      if (block == match.end()) continue;
      names = AmbientNames(truths[t].name, layout.blocks()[block - match.begin()].space);
      break;
    }
    columns.push_back(std::move(names));
  }
  return columns;
}

}  // namespace

SourceFiles::SourceFiles(const OutputFolder& folder, const Experiment& experiment)
    : streams_(experiment.source->streams()),
      truths_(experiment.source->truths()),
      truth_columns_(TruthColumns(experiment)),
      stream_rows_(streams_.size(), 0),
      expected_rows_(streams_.size(), 0) {
  for (const StreamInfo& stream : streams_) {
    width_ = std::max(width_, static_cast<std::size_t>(stream.size));
    known_width_ = std::max(known_width_, static_cast<std::size_t>(stream.known));
  }
  std::vector<std::string> header = {"t_s", "stream", "landmark"};
  for (std::size_t i = 0; i < width_; ++i) header.push_back('v' + std::to_string(i));
  for (std::size_t i = 0; i < known_width_; ++i) header.push_back("known" + std::to_string(i));
  measurements_.emplace(folder, "measurements.csv", header);
  if (!truths_.empty()) {
    header = {"t_s"};
    for (const auto& names : truth_columns_)
      header.insert(header.end(), names.begin(), names.end());
    truth_.emplace(folder, "truth.csv", header);
    if (const auto pose = FindPose(truths_)) poses_.emplace(folder, "truth.tum", *pose);
  }
  FindInverses(experiment);
  if (!expectations_.empty()) {
    header = {"t_s", "stream"};
    for (std::size_t i = 0; i < width_; ++i) header.push_back('v' + std::to_string(i));
    expected_.emplace(folder, "expected.csv", header);
  }
  if (inverses_.empty()) return;
  header = {"t_s", "sensor"};
  for (const Inverse& inverse : inverses_) {
    if (inverse.recorded.cell + 2 == header.size()) header.push_back(inverse.recorded.block);
  }
  blocks_ = header.size() - 2;
  implied_.emplace(folder, "implied_states.csv", header);
}

void SourceFiles::FindInverses(const Experiment& experiment) {
  std::set<std::string> sensors;
  std::map<std::string, std::size_t> cells;
  for (const EstimatorSpec& spec : experiment.estimators) {
    const Problem& problem = spec.problem;
    for (const SensorBinding& binding : problem.sensors) {
      const auto stream = std::find_if(streams_.begin(), streams_.end(), [&](const StreamInfo& s) {
        return s.name == binding.stream;
      });
      if (stream == streams_.end() || !sensors.insert(binding.name).second) continue;
      const int s = static_cast<int>(stream - streams_.begin());
      std::vector<int> truths = TruthsOfRoles(problem, binding, truths_);
      if (!truths.empty()) {
        expectations_.try_emplace(s, Expectation{binding.model, std::move(truths)});
      }
      std::optional<ImpliedState> state = ImpliedState::Of(problem, binding, truths_);
      if (!state) continue;
      const Block& block = problem.layout[state->block()];
      const std::size_t cell = cells.try_emplace(block.name, cells.size()).first->second;
      RecordedImplied recorded{binding.name, block.name, UnitOf(problem, state->block()),
                               state->uses_true_roles(), cell};
      inverses_.push_back({s, *std::move(state), std::move(recorded)});
    }
  }
}

void SourceFiles::Add(const SourceFrame& frame) {
  if (first_ == kNoTimestamp) first_ = frame.timestamp;
  last_ = frame.timestamp;
  for (const Measurement& m : frame.measurements) {
    const auto stream = static_cast<std::size_t>(m.stream);
    ++stream_rows_[stream];
    measurements_->Time(m.timestamp).Text(streams_[stream].name).Landmark(m.landmark);
    measurements_->Numbers(m.values.data(), m.values.size(), width_);
    measurements_->Numbers(m.known.data(), m.known.size(), known_width_).EndRow();
    AddExpected(frame, m);
    AddImplied(frame, m);
  }
  if (!truth_) return;
  if (poses_) poses_->AddTruth(frame);
  truth_->Time(frame.timestamp);
  for (std::size_t t = 0; t < truths_.size(); ++t) {
    const auto size = static_cast<std::size_t>(truths_[t].size);
    if (t < frame.truth.size() && !frame.truth[t].empty()) {
      truth_->Numbers(frame.truth[t].data(), frame.truth[t].size(), size);
    } else {
      truth_->Empty(size);
    }
  }
  truth_->EndRow();
}

void SourceFiles::AddExpected(const SourceFrame& frame, const Measurement& m) {
  const auto found = expectations_.find(m.stream);
  if (found == expectations_.end()) return;
  const auto& [model, truths] = found->second;
  const std::vector<const double*> roles = RolesAtTruth(frame.truth, truths);
  std::vector<double> z(m.values.size());
  if (roles.empty() || model->Predict(roles.data(), z.data(), m.known.data()) != Status::kOk) {
    return;
  }
  const auto stream = static_cast<std::size_t>(m.stream);
  expected_->Time(m.timestamp).Text(streams_[stream].name);
  expected_->Numbers(z.data(), z.size(), width_).EndRow();
  ++expected_rows_[stream];
}

void SourceFiles::AddImplied(const SourceFrame& frame, const Measurement& m) {
  for (Inverse& inverse : inverses_) {
    if (inverse.stream != m.stream) continue;
    const std::optional<double> value = inverse.state.From(frame.truth, m.values.data());
    if (!value) continue;
    const std::size_t columns_before = inverse.recorded.cell;
    implied_->Time(m.timestamp).Text(inverse.recorded.sensor).Empty(columns_before).Number(*value);
    implied_->Empty(blocks_ - columns_before - 1).EndRow();
    ++inverse.recorded.rows;
  }
}

void SourceFiles::Close() {
  measurements_->Close();
  if (truth_) truth_->Close();
  if (poses_) poses_->Close();
  if (expected_) expected_->Close();
  if (implied_) implied_->Close();
}

void SourceFiles::Describe(RecordedRun& run) const {
  for (std::size_t s = 0; s < streams_.size(); ++s) {
    run.streams.push_back({streams_[s].name, streams_[s].size, stream_rows_[s], expected_rows_[s]});
  }
  for (const Inverse& inverse : inverses_) run.implied.push_back(inverse.recorded);
  if (first_ != kNoTimestamp) {
    run.first = first_;
    run.last = last_;
  }
  run.measurement_rows = measurements_->rows();
  if (truth_) run.truth_rows = truth_->rows();
  if (expected_) run.expected_rows = expected_->rows();
  if (implied_) run.implied_rows = implied_->rows();
}

}  // namespace alidade::internal
