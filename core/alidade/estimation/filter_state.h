// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "alidade/estimation/estimator.h"
#include "alidade/estimation/motions.h"
#include "alidade/estimation/problem_index.h"
#include "alidade/state/kalman_update.h"
#include "alidade/state/state.h"
#include "alidade/state/workspace.h"

namespace alidade::internal {

/// Health of a filter, and the findings that were already reported: each is reported once.
struct Health {
  std::vector<char> out_of_domain, inflated;  ///< by sensor: since its last acceptance
  bool diverged = false, ended = false;
  /// The last accepted measurement.
  struct {
    int sensor = -1;
    Timestamp timestamp = kNoTimestamp;
    std::vector<double> z;
  } last_used;
};

/// State shared by the parts of a filter: x and P, the time, the motion models, the report. Only an
/// UpdateMethod changes P of blocks that have a value, because it may store a root of P. A function
/// that makes an exception documents it. A copy is a snapshot.
struct FilterState {
  FilterState(std::shared_ptr<const ProblemIndex> index, bool uses_first_estimates);

  int size() const { return state.covariance().size(); }  ///< n
  /// Updates the members that depend on the set of blocks with a value. Has to be called when a
  /// block gets its first value, or a new value that replaces a rejected one.
  void Activate();
  /// Whether first_estimates are in use (JacobianPolicy::kFirstEstimate).
  bool uses_first_estimates() const { return uses_first_estimates_; }

  std::shared_ptr<const ProblemIndex> problem_index;
  State state;
  Timestamp timestamp = kNoTimestamp;  ///< of the state
  Motions motions;
  /// By block of the problem: the value at which H is computed; empty: the latest estimate.
  std::vector<std::vector<double>> first_estimates;
  UpdateReport report;  ///< of the frame
  Health health;
  /// Summary of the blocks of the problem, by Activate.
  struct {
    bool has_missing = false;    ///< a block has no value yet
    bool has_consider = false;   ///< a block is a consider state
    std::vector<int> gain_rows;  ///< rows of P of the blocks that have a value
  } blocks;
  /// Temporary matrices. A function that uses it has a Workspace::Use.
  Scratch<Workspace> work;
  Scratch<std::vector<double>> moved;  ///< the corrected x, before the update is committed
  Scratch<KalmanUpdate> update;        ///< the last update of a method with Jacobians

 private:
  void StoreFirstEstimates();

  bool uses_first_estimates_;
};

/// Appends an event to the report. Its timestamp is set at the end of the frame.
Event& AddEvent(FilterState& f, EventKind kind, std::string text);
/// Appends an event after which the filter counts as diverged.
void AddDivergenceEvent(FilterState& f, EventKind kind, std::string text);
/// Returns `block = value, ...` for those of the blocks that have a value.
std::string Describe(const State& state, std::span<const BlockId> blocks);
/// Ends the filter with an event: the reason, the last good state, the last used measurement.
void End(FilterState& f, EventKind kind, const std::string& reason);

}  // namespace alidade::internal
