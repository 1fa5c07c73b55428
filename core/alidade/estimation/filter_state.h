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

/// Health of a filter. Also records which faults were already reported, because a fault is not
/// reported repeatedly.
struct Health {
  /// By sensor: whether h was not defined since its last accepted measurement.
  std::vector<char> out_of_domain;
  std::vector<char> digits_lost;  ///< by sensor: whether CheckDigits reported it
  bool diverged = false, ended = false;
  /// Last measurement that an update used.
  struct {
    int sensor = -1;
    Timestamp timestamp = kNoTimestamp;
    std::vector<double> z;
  } last_used;
};

/// State shared by the parts of a filter: x and P, the time, the motion models, the report. Only an
/// UpdateMethod and Recovery change P of blocks that have a value. An UpdateMethod may store a root
/// of P, so Recovery calls UpdateMethod::Begin afterwards. A copy is a snapshot.
struct FilterState {
  FilterState(std::shared_ptr<const ProblemIndex> index, bool uses_first_estimates);

  /// n: number of rows of P, including gaps
  int size() const { return state.covariance().size(); }
  /// Updates the members that depend on the set of blocks with a value. Must be called after a
  /// block was initialised or reset.
  void Activate();
  /// Returns whether first_estimates are used (JacobianPolicy::kFirstEstimate).
  bool uses_first_estimates() const { return uses_first_estimates_; }

  std::shared_ptr<const ProblemIndex> problem_index;
  State state;
  Timestamp timestamp = kNoTimestamp;  ///< time of the state
  Motions motions;
  /// By block of the problem: the value at which H is evaluated. Empty: H is evaluated at the
  /// latest estimate.
  std::vector<std::vector<double>> first_estimates;
  UpdateReport report;  ///< report of the current frame
  Health health;
  /// Summary of the blocks of the problem, updated by Activate().
  struct {
    bool has_missing = false;    ///< whether a block has no value yet
    bool has_consider = false;   ///< whether a block is a consider state
    std::vector<int> gain_rows;  ///< rows of P of the blocks that have a value
  } blocks;
  /// Memory for temporary matrices. A function that uses it must create a Workspace::Use.
  Scratch<Workspace> work;
  Scratch<std::vector<double>> moved;  ///< corrected x, before it replaces the state
  Scratch<KalmanUpdate> update;        ///< last update of a method that computes Jacobians

 private:
  void StoreFirstEstimates();

  bool uses_first_estimates_;
};

/// Appends an event to the report. The timestamp of the event is set at the end of the frame.
Event& AddEvent(FilterState& f, EventKind kind, std::string text);
/// Appends an event and marks the filter as diverged.
void AddDivergenceEvent(FilterState& f, EventKind kind, std::string text);
/// Returns the text `block = value, ...`. Omits blocks without a value.
std::string Describe(const State& state, std::span<const BlockId> blocks);
/// Ends the filter. Appends an event with the reason, the last valid state and the last used
/// measurement.
void End(FilterState& f, EventKind kind, const std::string& reason);

}  // namespace alidade::internal
