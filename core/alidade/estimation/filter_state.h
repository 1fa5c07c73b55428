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

/// How a filter is, and what it has said of that, so that it says it once.
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

/// What the parts of a filter share: x and P, what moved them last, and what there is to say of it.
/// Only a Method changes P of blocks that have a value, but where the part that does it says so: a
/// method may carry a root. A copy is a snapshot.
struct FilterState {
  FilterState(std::shared_ptr<const ProblemIndex> of, bool keeps_first_estimates);

  int size() const { return state.covariance().size(); }  ///< n
  /// Has to be called when a block of the problem gets a value, its first or another one in place
  /// of a rejected one.
  void Activate();
  /// Whether there are any first_estimates.
  bool keeps_first_estimates() const { return keeps_first_estimates_; }

  std::shared_ptr<const ProblemIndex> index;
  State state;
  Timestamp timestamp = kNoTimestamp;  ///< of the state
  Motions motions;
  /// By block of the problem: the value that H is taken at; empty: the latest.
  std::vector<std::vector<double>> first_estimates;
  UpdateReport report;  ///< of the frame
  Health health;
  /// What Activate last found among the blocks of the problem.
  struct {
    bool waiting = false;        ///< one has no value yet
    bool considering = false;    ///< one is a consider state
    std::vector<int> gain_rows;  ///< of P: of those that have a value
  } blocks;
  /// Matrices; what takes from it has a Workspace::Use around it.
  Scratch<Workspace> work;
  Scratch<std::vector<double>> moved;  ///< values on the way to x
  Scratch<KalmanUpdate> update;        ///< the last one of a method with Jacobians

 private:
  void KeepFirstEstimates();

  bool keeps_first_estimates_;
};

/// An event of the frame; the end of the frame gives it its timestamp.
Event& Note(FilterState& f, const char* kind, std::string text);
/// The same of an event by which the filter counts as diverged.
void NoteDivergence(FilterState& f, const char* kind, std::string text);
/// `block = value, ...` of the given blocks that have one.
std::string Describe(const State& state, std::span<const BlockId> blocks);
/// Ends the filter: what happened, the state that is left, the measurement that led there.
void End(FilterState& f, const char* kind, const std::string& what);

}  // namespace alidade::internal
