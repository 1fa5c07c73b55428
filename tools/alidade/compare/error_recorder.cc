// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/error_recorder.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "alidade/experiment/joint_nees.h"
#include "alidade/experiment/truth_match.h"
#include "alidade/record/errors_file.h"

namespace alidade::internal {
namespace {

constexpr double kNoError = std::numeric_limits<double>::quiet_NaN();

/// Removes the rows with an odd index from a table with `columns` columns.
void RemoveOddRowsOf(std::size_t columns, std::vector<double>& cells) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (i / columns % 2 == 0) cells[count++] = cells[i];
  }
  cells.resize(count);
}

}  // namespace

ErrorRecorder::ErrorRecorder(const EstimatorSpec& spec, const Experiment& experiment) {
  if (experiment.reference >= 0) return;
  const std::vector<StreamInfo> truths = experiment.source->truths();
  const StateLayout& layout = spec.problem.layout;
  const std::vector<int> match = MatchTruths(layout, truths);
  for (BlockId id = 0; id < std::ssize(match); ++id) {
    const int truth_index = match[static_cast<std::size_t>(id)];
    if (truth_index < 0) continue;
    const auto truth = static_cast<std::size_t>(truth_index);
    const double sigma =
        experiment.truth_sigmas.empty() ? truths[truth].sigma : experiment.truth_sigmas.at(truth);
    const std::string& owner = layout[id].owner;
    const auto position = std::ranges::find(series_.owners, owner);
    blocks_.push_back({id, truth, static_cast<std::size_t>(position - series_.owners.begin()),
                       sigma * sigma, LargestPriorSigma(spec.problem, id)});
    blocks_.back().error.resize(layout[id].geometry().tangent);
    if (position == series_.owners.end()) series_.owners.push_back(owner);
    series_.blocks.push_back(layout[id].name);
    series_.angles.push_back(layout[id].geometry().is_angular());
  }
  const bool is_online = spec.kind == EstimatorKind::kFilter ||
                         (spec.kind == EstimatorKind::kBatch && !spec.estimator->offline());
  if (!is_online || blocks_.empty()) return;
  series_.no_bound_reason = CramerRaoBound::WhyUnavailable(spec.problem, truths);
  if (!series_.no_bound_reason.empty()) return;
  const Source* source = experiment.source.get();
  bound_.emplace(spec.problem, experiment.source->streams(), truths,
                 [source](std::int64_t id) { return source->TrueLandmark(id); });
}

ErrorSeries ErrorRecorder::Finish() {
  for (std::size_t i = 0; bound_ && i < blocks_.size(); ++i) {
    const TrackedBlock& tracked = blocks_[i];
    if (tracked.bound_count == 0) continue;
    series_.by_bound[series_.blocks[i]] =
        tracked.sum_by_bound / static_cast<double>(tracked.bound_count);
  }
  return std::move(series_);
}

bool ErrorRecorder::AddBound(const SourceFrame& frame) {
  if (!bound_->Add(frame)) return false;
  const State& state = bound_->state();
  for (TrackedBlock& tracked : blocks_) {
    const Block& block = state.layout()[tracked.id];
    tracked.bound = 0.0;
    for (int i = 0; block.present && i < block.geometry().tangent; ++i) {
      tracked.bound += state.sigma(tracked.id, i) * state.sigma(tracked.id, i);
    }
    if (!tracked.has_error || !(tracked.bound > 0.0)) continue;
    tracked.sum_by_bound += tracked.error.squaredNorm() / tracked.bound;
    ++tracked.bound_count;
  }
  return true;
}

void ErrorRecorder::Add(const SourceFrame& frame, const State& state) {
  if (blocks_.empty()) return;
  for (TrackedBlock& tracked : blocks_) {
    const Block& block = state.layout()[tracked.id];
    tracked.has_error =
        tracked.truth < frame.truth.size() && !frame.truth[tracked.truth].empty() && block.present;
    if (!tracked.has_error) continue;
    block.geometry().Minus(frame.truth[tracked.truth].data(), state.value(tracked.id),
                           tracked.error.data());
  }
  if (bound_ && !AddBound(frame)) {
    bound_.reset();
    series_.bounds.clear();
    series_.no_bound_reason =
        "at one of the timestamps, the truth of a block or landmark is missing, or a model is not "
        "defined";
  }
  if (count_++ % stride_ == 0) AppendTimestamp(frame.timestamp, state);
}

void ErrorRecorder::AppendTimestamp(Timestamp timestamp, const State& state) {
  series_.timestamps.push_back(timestamp);
  for (const TrackedBlock& tracked : blocks_) {
    series_.squares.push_back(tracked.has_error ? tracked.error.squaredNorm() : kNoError);
    if (bound_) series_.bounds.push_back(tracked.bound);
  }
  for (std::size_t owner = 0; owner < series_.owners.size(); ++owner) {
    std::vector<BlockError> errors;
    for (const TrackedBlock& tracked : blocks_) {
      if (tracked.has_error && tracked.owner == owner) {
        errors.push_back({tracked.id, &tracked.error, tracked.truth_variance, tracked.prior_sigma});
      }
    }
    const Nees nees = JointNees(state, errors);
    series_.nees.push_back(nees.dof > 0 ? nees.value : kNoError);
    series_.dofs.push_back(nees.dof);
  }
  if (series_.timestamps.size() == kMaxTimestamps) RemoveOddRows();
}

void ErrorRecorder::RemoveOddRows() {
  for (std::size_t i = 0; 2 * i < kMaxTimestamps; ++i)
    series_.timestamps[i] = series_.timestamps[2 * i];
  series_.timestamps.resize(kMaxTimestamps / 2);
  RemoveOddRowsOf(series_.blocks.size(), series_.squares);
  RemoveOddRowsOf(series_.blocks.size(), series_.bounds);
  RemoveOddRowsOf(series_.owners.size(), series_.nees);
  RemoveOddRowsOf(series_.owners.size(), series_.dofs);
  stride_ *= 2;
}

}  // namespace alidade::internal
