// SPDX-License-Identifier: Apache-2.0
#include "source_files.h"

#include <algorithm>
#include <map>
#include <set>

#include "columns.h"

namespace alidade::internal {
namespace {

/// True where `binding` tells one scalar block from its measurement alone.
bool IsInvertible(const System& system, const SensorBinding& binding) {
  const int role = binding.model.initialised_role();
  if (role < 0) return false;
  for (int r = 0; r < static_cast<int>(binding.roles.size()); ++r) {
    if (r != role && binding.roles[r].block >= 0) return false;
  }
  const BlockId block = binding.roles[role].block;
  return block >= 0 && system.layout[block].geometry().ambient == 1;
}

/// By truth and element.
std::vector<std::vector<std::string>> TruthColumns(const Experiment& experiment) {
  const std::vector<StreamInfo>& truths = experiment.source->truths();
  std::vector<std::vector<std::string>> columns;
  for (std::size_t t = 0; t < truths.size(); ++t) {
    std::vector<std::string> names = NumberedNames(truths[t].name, truths[t].size);
    // Elements are named as in the first state that has this block.
    for (const NamedEstimator& named : experiment.estimators) {
      const StateLayout& layout = named.system.layout;
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

SourceFiles::SourceFiles(const RunFolder& folder, const Experiment& experiment)
    : streams_(experiment.source->streams()),
      truths_(experiment.source->truths()),
      truth_columns_(TruthColumns(experiment)),
      stream_rows_(streams_.size(), 0) {
  for (const StreamInfo& stream : streams_) {
    width_ = std::max(width_, static_cast<std::size_t>(stream.size));
  }
  std::vector<std::string> header = {"t_s", "stream", "landmark"};
  for (std::size_t i = 0; i < width_; ++i) header.push_back('v' + std::to_string(i));
  measurements_.emplace(folder, "measurements.csv", header);
  if (!truths_.empty()) {
    header = {"t_s"};
    for (const auto& names : truth_columns_)
      header.insert(header.end(), names.begin(), names.end());
    truth_.emplace(folder, "truth.csv", header);
  }
  FindInverses(experiment);
  if (inverses_.empty()) return;
  header = {"t_s", "sensor"};
  for (const Inverse& inverse : inverses_) {
    if (inverse.recorded.cell + 2 == header.size()) header.push_back(inverse.recorded.block);
  }
  blocks_ = header.size() - 2;
  implied_.emplace(folder, "implied.csv", header);
}

void SourceFiles::FindInverses(const Experiment& experiment) {
  std::set<std::string> sensors;
  std::map<std::string, std::size_t> cells;
  for (const NamedEstimator& named : experiment.estimators) {
    const System& system = named.system;
    for (const SensorBinding& binding : system.sensors) {
      const auto stream = std::find_if(streams_.begin(), streams_.end(), [&](const StreamInfo& s) {
        return s.name == binding.stream;
      });
      if (stream == streams_.end() || !IsInvertible(system, binding)) continue;
      if (!sensors.insert(binding.name).second) continue;
      const BlockId id = binding.roles[binding.model.initialised_role()].block;
      const Block& block = system.layout[id];
      const std::size_t cell = cells.try_emplace(block.name, cells.size()).first->second;
      inverses_.push_back({static_cast<int>(stream - streams_.begin()),
                           binding.model,
                           {binding.name, block.name, UnitOf(system, id), cell, 0}});
    }
  }
}

void SourceFiles::Add(const Frame& frame) {
  if (first_ == kNoStamp) first_ = frame.stamp;
  last_ = frame.stamp;
  for (const Measurement& m : frame.measurements) {
    const auto stream = static_cast<std::size_t>(m.stream);
    ++stream_rows_[stream];
    measurements_->Time(m.stamp).Text(streams_[stream].name).Landmark(m.landmark);
    measurements_->Numbers(m.values.data(), m.values.size(), width_).EndRow();
    AddImplied(m);
  }
  if (!truth_) return;
  truth_->Time(frame.stamp);
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

void SourceFiles::AddImplied(const Measurement& m) {
  for (Inverse& inverse : inverses_) {
    if (inverse.stream != m.stream || inverse.model.Valid(m.values.data()) != Status::kOk) continue;
    const std::vector<const double*> roles(inverse.model.roles().size(), nullptr);
    double value = 0.0;
    if (inverse.model.Initialise(roles.data(), m.values.data(), &value, nullptr, nullptr) !=
        Status::kOk) {
      continue;
    }
    const std::size_t before = inverse.recorded.cell;
    implied_->Time(m.stamp).Text(inverse.recorded.sensor).Empty(before).Number(value);
    implied_->Empty(blocks_ - before - 1).EndRow();
    ++inverse.recorded.rows;
  }
}

void SourceFiles::Close() {
  measurements_->Close();
  if (truth_) truth_->Close();
  if (implied_) implied_->Close();
}

void SourceFiles::Describe(RecordedRun& run) const {
  for (std::size_t s = 0; s < streams_.size(); ++s) {
    run.streams.push_back({streams_[s].name, streams_[s].size, stream_rows_[s]});
  }
  for (const Inverse& inverse : inverses_) run.implied.push_back(inverse.recorded);
  if (first_ != kNoStamp) {
    run.first = first_;
    run.last = last_;
  }
  run.measurement_rows = measurements_->rows();
  if (truth_) run.truth_rows = truth_->rows();
  if (implied_) run.implied_rows = implied_->rows();
}

}  // namespace alidade::internal
