// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/source_files.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "alidade/state/element_names.h"
#include "alidade/system/truth_match.h"

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

/// The truth of each role; empty where one is unbound or has none.
std::vector<int> TruthsOf(const System& system, const SensorBinding& binding,
                          const std::vector<StreamInfo>& truths) {
  const std::vector<int> match = MatchTruths(system.layout, truths);
  std::vector<int> found;
  for (const RoleBinding& role : binding.roles) {
    found.push_back(role.block < 0 ? -1 : match[static_cast<std::size_t>(role.block)]);
    if (found.back() < 0) return {};
  }
  return found;
}

/// Whether measurement and roles are scalars.
bool IsScalar(const SensorBinding& binding) {
  const auto scalar = [](const Space& space) {
    return space.geometry.kind == GeometryKind::kVector && space.geometry.ambient == 1;
  };
  return scalar(binding.model.measurement()) && std::ranges::all_of(binding.model.roles(), scalar);
}

/// Values of the roles at the frame's truth; empty where one is not known there.
std::vector<const double*> AtTruth(const SourceFrame& frame, const std::vector<int>& truths) {
  std::vector<const double*> roles;
  for (const int truth : truths) {
    const auto t = static_cast<std::size_t>(truth);
    if (t >= frame.truth.size() || frame.truth[t].empty()) return {};
    roles.push_back(frame.truth[t].data());
  }
  return roles;
}

/// x of the first role with h(x) = z, all scalar and the others as they are, by Newton's method
/// from where it is; none where that does not converge.
std::optional<double> SolveForFirst(const SensorModel& model, std::vector<const double*> roles,
                                    double z) {
  constexpr int kMostSteps = 20;
  double x = *roles[0];
  roles[0] = &x;
  double slope = 0.0, h = 0.0;
  std::vector<double*> jacobians(roles.size(), nullptr);
  jacobians[0] = &slope;
  const std::vector<int> strides(roles.size(), 1);
  for (int i = 0; i < kMostSteps; ++i) {
    if (model.Linearise(roles.data(), &h, jacobians.data(), strides.data()) != Status::kOk) break;
    const double step = (z - h) / slope;
    if (!std::isfinite(step)) break;
    x += step;
    if (std::abs(step) <= 1e-12 * std::abs(x)) return x;
  }
  return {};
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
  for (const NamedEstimator& named : experiment.estimators) {
    const System& system = named.system;
    for (const SensorBinding& binding : system.sensors) {
      const auto stream = std::find_if(streams_.begin(), streams_.end(), [&](const StreamInfo& s) {
        return s.name == binding.stream;
      });
      if (stream == streams_.end() || !sensors.insert(binding.name).second) continue;
      const int s = static_cast<int>(stream - streams_.begin());
      const std::vector<int> truths = TruthsOf(system, binding, truths_);
      if (!truths.empty()) expectations_.try_emplace(s, Expectation{binding.model, truths});
      if (binding.model.known_size() > 0) continue;  // one curve for all would need them
      const bool by_itself = IsInvertible(system, binding);
      if (!by_itself && (truths.empty() || !IsScalar(binding))) continue;
      const int role = by_itself ? binding.model.initialised_role() : 0;
      const BlockId id = binding.roles[static_cast<std::size_t>(role)].block;
      const Block& block = system.layout[id];
      const std::size_t cell = cells.try_emplace(block.name, cells.size()).first->second;
      inverses_.push_back({s,
                           binding.model,
                           {binding.name, block.name, UnitOf(system, id), !by_itself, cell, 0},
                           by_itself ? std::vector<int>{} : truths});
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
  const std::vector<const double*> roles = AtTruth(frame, truths);
  std::vector<double> z(m.values.size());
  if (roles.empty() || model.Predict(roles.data(), z.data(), m.known.data()) != Status::kOk) {
    return;
  }
  const auto stream = static_cast<std::size_t>(m.stream);
  expected_->Time(m.timestamp).Text(streams_[stream].name);
  expected_->Numbers(z.data(), z.size(), width_).EndRow();
  ++expected_rows_[stream];
}

void SourceFiles::AddImplied(const SourceFrame& frame, const Measurement& m) {
  for (Inverse& inverse : inverses_) {
    if (inverse.stream != m.stream || inverse.model.Valid(m.values.data()) != Status::kOk) continue;
    double value = 0.0;
    if (inverse.recorded.rest_at_truth) {
      const std::vector<const double*> roles = AtTruth(frame, inverse.truths);
      if (roles.empty()) continue;
      const auto solved = SolveForFirst(inverse.model, roles, m.values[0]);
      if (!solved) continue;
      value = *solved;
    } else {
      const std::vector<const double*> roles(inverse.model.roles().size(), nullptr);
      if (inverse.model.Initialise(roles.data(), m.values.data(), &value, nullptr, nullptr) !=
          Status::kOk) {
        continue;
      }
    }
    const std::size_t before = inverse.recorded.cell;
    implied_->Time(m.timestamp).Text(inverse.recorded.sensor).Empty(before).Number(value);
    implied_->Empty(blocks_ - before - 1).EndRow();
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
