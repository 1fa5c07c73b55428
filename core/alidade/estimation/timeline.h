// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "alidade/estimation/estimator.h"
#include "alidade/estimation/motions.h"
#include "alidade/estimation/problem.h"

namespace alidade::internal {

/// Division of the time between two timestamps into sub-steps. Control inputs are constant during a
/// sub-step (zero-order hold), and a sub-step has equal steps of at most max_dt_s.
///
///   u(t) = u_k   for t_k <= t < min(t_{k+1}, t_k + timeout)
///   u(t) = 0     for any other t: the neutral element of the input's geometry
///
///   symbol    unit         meaning
///   u_k       the model's  a control input
///   t_k       s            timestamp of its frame
///   timeout   s            InputBinding::timeout_s
///
/// A copy is a snapshot.
class Timeline {
 public:
  /// Sequence of equal steps from `start` to `end`.
  struct SubStep {
    Timestamp start = 0, end = 0;
    Timestamp steps = 0;
    double dt_s = 0.0;
    /// Returns the end of step `i`, counted from 1.
    Timestamp EndOf(Timestamp i) const {
      return i == steps ? end : start + (end - start) / steps * i;
    }
  };

  /// `streams` are the streams of the source, in the order of Measurement::stream.
  /// ContractViolation if a stream has another size than the control input that it provides.
  Timeline(const Problem& problem, const std::vector<StreamInfo>& streams, double max_dt_s);

  /// Returns the time of the priors: initial_time_s, or else the timestamp of the first frame.
  Timestamp StartFor(const Frame& first) const { return start_.value_or(first.timestamp); }
  /// Computes the next sub-step from `start` towards the later `end`. If it has at least twice as
  /// many steps as any sub-step before, the event `substeps` reports it. Returns an error if it
  /// would need too many steps.
  StepError NextSubStep(Timestamp start, Timestamp end, std::vector<Event>& events,
                        SubStep& sub_step);

  /// Returns whether a model has a control input.
  bool has_inputs() const { return !inputs_.empty(); }
  /// Returns u (ambient) during the sub-step that starts at `start`, for Problem::motions[motion];
  /// empty if the model has no control input. If no input acts, the event `input_stale` reports it,
  /// once until an input acts. Valid until the next TakeInputs.
  std::span<const double> Input(std::size_t motion, Timestamp start, std::vector<Event>& events);
  /// Sets the control inputs of the active motion models.
  void UseInputs(Timestamp start, Motions& motions, std::vector<Event>& events);
  /// Stores the control inputs of a frame, which act from its timestamp on, and appends their
  /// motion models to `report.inputs`. Inputs older than the stored one are ignored. An input that
  /// is not finite or does not have unit length is rejected. The event `input_refused` reports
  /// this, once until an input is accepted. The covariance of an input is not used; its noise is
  /// that of the model.
  void TakeInputs(const Frame& frame, UpdateReport& report);

 private:
  /// Latest control input of a motion model.
  struct StoredInput {
    std::size_t motion = 0;
    std::string name;  ///< of the state entry
    InputBinding binding;
    Geometry geometry;
    int stream = -1;  ///< -1: the source has no stream of that name
    Timestamp timeout = 0;
    std::vector<double> value, neutral;
    Timestamp timestamp = kNoTimestamp;   ///< of the value
    Timestamp expiration = kNoTimestamp;  ///< time at which it stops acting
    bool stale_reported = false, refusal_reported = false;
  };
  static bool IsActive(const StoredInput& input, Timestamp time) { return time < input.expiration; }
  static std::string DescribeMissing(const StoredInput& input);

  std::vector<StoredInput> inputs_;  ///< of the models with a control input
  std::optional<Timestamp> start_;
  double max_dt_s_;
  Timestamp max_dt_;                  ///< max_dt_s in whole ns, at least one
  Timestamp max_reported_steps_ = 1;  ///< of a sub-step
};

}  // namespace alidade::internal
