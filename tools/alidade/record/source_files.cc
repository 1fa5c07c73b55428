// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/source_files.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "alidade/experiment/truth_match.h"
#include "alidade/state/element_names.h"

namespace alidade::internal {
namespace {

/// Returns, for each truth, the names of the columns of its elements in truth.csv.
std::vector<std::vector<std::string>> TruthColumns(const Experiment& experiment) {
  const std::vector<StreamInfo>& truths = experiment.source->truths();
  std::vector<std::vector<std::string>> columns;
  for (std::size_t t = 0; t < truths.size(); ++t) {
    std::vector<std::string> names = NumberedNames(truths[t].name, truths[t].size);
    // The first estimator whose state contains the block determines the names of its elements.
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

SourceFiles::SourceFiles(const OutputFolder& folder, const Experiment& experiment,
                         RunColumns& run_columns)
    : streams_(experiment.source->streams()),
      truth_layout_{experiment.source->truths(), TruthColumns(experiment)} {
  for (const StreamInfo& stream : streams_) {
    layout_.width = std::max(layout_.width, static_cast<std::size_t>(stream.size));
    layout_.known_width = std::max(layout_.known_width, static_cast<std::size_t>(stream.known));
    const auto rows = static_cast<std::size_t>(stream.covariance);
    layout_.covariance_width = std::max(layout_.covariance_width, rows * rows);
  }
  const auto create = [&](const char* name, const auto& table, const auto& layout) {
    std::vector<Column> columns;
    AppendColumns(table, layout, columns);
    return CreateCsv(folder, name, std::move(columns), run_columns);
  };
  measurements_ = create("measurements.csv", kMeasurementColumns, layout_);
  const std::vector<StreamInfo>& truths = truth_layout_.truths;
  if (!truths.empty()) {
    truth_ = create("truth.csv", kTruthColumns, truth_layout_);
    if (const auto pose = FindPose(truths)) poses_.emplace(folder, "truth.tum", *pose);
  }
  FindInverses(experiment);
  if (!expectations_.empty()) {
    expected_ = create("expected.csv", kExpectedColumns, ExpectedLayout{layout_.width});
  }
  if (inverses_.empty()) return;
  implied_ = create("implied_states.csv", kImpliedColumns, implied_layout_);
}

void SourceFiles::FindInverses(const Experiment& experiment) {
  std::set<std::string> sensors;
  for (const EstimatorSpec& spec : experiment.estimators) {
    const Problem& problem = spec.problem;
    for (const SensorBinding& binding : problem.sensors) {
      const auto stream = std::find_if(streams_.begin(), streams_.end(), [&](const StreamInfo& s) {
        return s.name == binding.stream;
      });
      if (stream == streams_.end() || !sensors.insert(binding.name).second) continue;
      const int s = static_cast<int>(stream - streams_.begin());
      std::vector<int> truths = TruthsOfRoles(problem, binding, truth_layout_.truths);
      if (!truths.empty()) {
        expectations_.try_emplace(s, Expectation{binding.model, std::move(truths)});
      }
      std::optional<ImpliedState> state = ImpliedState::Of(problem, binding, truth_layout_.truths);
      if (!state) continue;
      const std::size_t column = AddImpliedColumn(problem, state->block());
      inverses_.push_back({s, *std::move(state), binding.name, column});
    }
  }
}

std::size_t SourceFiles::AddImpliedColumn(const Problem& problem, BlockId id) {
  const std::string& name = problem.layout[id].name;
  std::vector<Column>& columns = implied_layout_.blocks;
  auto column = std::ranges::find(columns, name, &Column::name);
  if (column == columns.end()) {
    column = columns.insert(column, {name, UnitOf(problem, id), "", name});
  }
  return static_cast<std::size_t>(column - columns.begin());
}

const std::string& SourceFiles::StreamOf(const Measurement& measurement) const {
  return streams_[static_cast<std::size_t>(measurement.stream)].name;
}

void SourceFiles::Add(const SourceFrame& frame) {
  for (const Measurement& m : frame.measurements) {
    WriteCells(kMeasurementColumns, layout_, {m, StreamOf(m)}, *measurements_);
    measurements_->EndRow();
    AddExpected(frame, m);
    AddImplied(frame, m);
  }
  if (!truth_) return;
  if (poses_) poses_->AddTruth(frame);
  WriteCells(kTruthColumns, truth_layout_, frame, *truth_);
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
  WriteCells(kExpectedColumns, ExpectedLayout{layout_.width}, {m.timestamp, StreamOf(m), z},
             *expected_);
  expected_->EndRow();
}

void SourceFiles::AddImplied(const SourceFrame& frame, const Measurement& m) {
  for (Inverse& inverse : inverses_) {
    if (inverse.stream != m.stream) continue;
    const std::optional<double> value = inverse.state.From(frame.truth, m.values.data());
    if (!value) continue;
    WriteCells(kImpliedColumns, implied_layout_,
               {m.timestamp, inverse.sensor, inverse.column, *value}, *implied_);
    implied_->EndRow();
  }
}

void SourceFiles::Close() {
  measurements_->Close();
  if (truth_) truth_->Close();
  if (poses_) poses_->Close();
  if (expected_) expected_->Close();
  if (implied_) implied_->Close();
}

}  // namespace alidade::internal
