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

/// The even rows of a table with so many columns.
void KeepEvenRows(std::size_t columns, std::vector<double>& cells) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (i / columns % 2 == 0) cells[kept++] = cells[i];
  }
  cells.resize(kept);
}

}  // namespace

ErrorRecorder::ErrorRecorder(const EstimatorSpec& spec, const Experiment& experiment) {
  if (experiment.reference >= 0) return;
  const std::vector<StreamInfo> truths = experiment.source->truths();
  const StateLayout& layout = spec.problem.layout;
  const std::vector<int> match = MatchTruths(layout, truths);
  for (BlockId id = 0; id < std::ssize(match); ++id) {
    const int of = match[static_cast<std::size_t>(id)];
    if (of < 0) continue;
    const auto truth = static_cast<std::size_t>(of);
    const double sigma =
        experiment.truth_sigmas.empty() ? truths[truth].sigma : experiment.truth_sigmas.at(truth);
    const std::string& owner = layout[id].owner;
    const auto place = std::ranges::find(series_.owners, owner);
    tracked_.push_back(
        {id, truth, static_cast<std::size_t>(place - series_.owners.begin()), sigma * sigma});
    tracked_.back().error.resize(layout[id].geometry().tangent);
    if (place == series_.owners.end()) series_.owners.push_back(owner);
    series_.blocks.push_back(layout[id].name);
    const std::vector<bool> angles = AreAngles(layout[id].geometry());
    series_.angles.push_back(std::ranges::find(angles, false) == angles.end());
  }
  const bool online = spec.kind == EstimatorKind::kFilter ||
                      (spec.kind == EstimatorKind::kBatch && !spec.estimator->offline());
  if (!online || tracked_.empty()) return;
  series_.no_bound = CramerRaoBound::WhyUnavailable(spec.problem, truths);
  if (!series_.no_bound.empty()) return;
  const Source* source = experiment.source.get();
  bound_.emplace(spec.problem, experiment.source->streams(), truths,
                 [source](std::int64_t id) { return source->TrueLandmark(id); });
}

ErrorSeries ErrorRecorder::Take() {
  for (std::size_t i = 0; bound_ && i < tracked_.size(); ++i) {
    const Tracked& one = tracked_[i];
    if (one.with_bound == 0) continue;
    series_.by_bound[series_.blocks[i]] = one.sum_by_bound / static_cast<double>(one.with_bound);
  }
  return std::move(series_);
}

bool ErrorRecorder::AddBound(const SourceFrame& frame) {
  if (!bound_->Add(frame)) return false;
  const State& state = bound_->state();
  for (Tracked& one : tracked_) {
    const Block& block = state.layout()[one.id];
    one.bound = 0.0;
    for (int i = 0; block.present && i < block.geometry().tangent; ++i) {
      one.bound += state.sigma(one.id, i) * state.sigma(one.id, i);
    }
    if (!one.known || !(one.bound > 0.0)) continue;
    one.sum_by_bound += one.error.squaredNorm() / one.bound;
    ++one.with_bound;
  }
  return true;
}

void ErrorRecorder::Add(const SourceFrame& frame, const State& state) {
  if (tracked_.empty()) return;
  for (Tracked& one : tracked_) {
    one.known = one.truth < frame.truth.size() && !frame.truth[one.truth].empty() &&
                state.layout()[one.id].present;
    if (!one.known) continue;
    state.layout()[one.id].geometry().Minus(frame.truth[one.truth].data(), state.value(one.id),
                                            one.error.data());
  }
  if (bound_ && !AddBound(frame)) {
    bound_.reset();
    series_.bounds.clear();
    series_.no_bound =
        "truth is not known of all blocks and landmarks at all timestamps, or a model is not "
        "defined there";
  }
  if (count_++ % stride_ == 0) Keep(frame.timestamp, state);
}

void ErrorRecorder::Keep(Timestamp timestamp, const State& state) {
  series_.timestamps.push_back(timestamp);
  for (const Tracked& one : tracked_) {
    series_.squares.push_back(one.known ? one.error.squaredNorm() : kNoError);
    if (bound_) series_.bounds.push_back(one.bound);
  }
  for (std::size_t owner = 0; owner < series_.owners.size(); ++owner) {
    std::vector<BlockError> errors;
    for (const Tracked& one : tracked_) {
      if (one.known && one.owner == owner) {
        errors.push_back({one.id, &one.error, one.truth_variance});
      }
    }
    const Nees nees = JointNees(state, errors);
    series_.nees.push_back(nees.dof > 0 ? nees.value : kNoError);
    series_.dofs.push_back(nees.dof);
  }
  if (series_.timestamps.size() == kMost) Thin();
}

void ErrorRecorder::Thin() {
  for (std::size_t i = 0; 2 * i < kMost; ++i) series_.timestamps[i] = series_.timestamps[2 * i];
  series_.timestamps.resize(kMost / 2);
  KeepEvenRows(series_.blocks.size(), series_.squares);
  KeepEvenRows(series_.blocks.size(), series_.bounds);
  KeepEvenRows(series_.owners.size(), series_.nees);
  KeepEvenRows(series_.owners.size(), series_.dofs);
  stride_ *= 2;
}

}  // namespace alidade::internal
