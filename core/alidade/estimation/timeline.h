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

/// Divides the time between two timestamps into sub-steps, and stores the control inputs. Control
/// inputs are constant during a sub-step (zero-order hold). A sub-step consists of equal steps of
/// at most max_dt_s.
///
///   u(t) = u_k   for t_k <= t < min(t_{k+1}, t_k + timeout)
///   u(t) = 0     at other times: the neutral element of the input's geometry
///
///   symbol    unit         meaning
///   u_k       the model's  a control input
///   t_k       s            timestamp of the frame of u_k
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
  /// ContractViolation if the size of a stream differs from the size of its control input.
  Timeline(const Problem& problem, const std::vector<StreamInfo>& streams, double max_dt_s);

  /// Returns the time of the priors: initial_time_s, or else the timestamp of the first frame.
  Timestamp StartFor(const Frame& first) const { return start_.value_or(first.timestamp); }
  /// Computes the sub-step from `start` towards `end`, which must be later. The event `substeps`
  /// reports a sub-step that has at least twice as many steps as every sub-step reported before.
  /// Returns an error if the sub-step needs too many steps.
  StepError NextSubStep(Timestamp start, Timestamp end, std::vector<Event>& events,
                        SubStep& sub_step);

  /// Returns whether any motion model has a control input.
  bool has_inputs() const { return !inputs_.empty(); }
  /// Returns u (ambient) of Problem::motions[motion] during the sub-step that starts at `start`, or
  /// an empty span if the model has no control input. The event `input_stale` reports the first
  /// sub-step in which no input acts. The span is valid until the next TakeInputs.
  std::span<const double> Input(std::size_t motion, Timestamp start, std::vector<Event>& events);
  /// Sets the control inputs of the active models in `motions`, for the sub-step that starts at
  /// `start`.
  void UseInputs(Timestamp start, Motions& motions, std::vector<Event>& events);
  /// Stores the control inputs of a frame, which act from the timestamp of the frame on. Appends
  /// the indices of their motion models to `report.inputs`. An input that is older than the stored
  /// input is ignored. An input that is not finite, or does not have the required unit length, is
  /// rejected. The event `input_refused` reports only the first of consecutive rejections. The
  /// covariance of an input is not used, because the model defines the noise of the input.
  void TakeInputs(const Frame& frame, UpdateReport& report);

 private:
  /// Latest control input of a motion model.
  struct StoredInput {
    std::size_t motion = 0;
    std::string name;  ///< name of the state entry
    InputBinding binding;
    Geometry geometry;
    int stream = -1;  ///< index of the stream; -1: the source does not have this stream
    Timestamp timeout = 0;
    std::vector<double> value, neutral;
    Timestamp timestamp = kNoTimestamp;   ///< timestamp of `value`
    Timestamp expiration = kNoTimestamp;  ///< time at which `value` stops acting
    bool stale_reported = false, refusal_reported = false;
  };
  static bool IsActive(const StoredInput& input, Timestamp time) { return time < input.expiration; }
  static std::string DescribeMissing(const StoredInput& input);

  std::vector<StoredInput> inputs_;  ///< one element for each model with a control input
  std::optional<Timestamp> start_;
  double max_dt_s_;
  Timestamp max_dt_;                  ///< max_dt_s in whole ns, at least 1 ns
  Timestamp max_reported_steps_ = 1;  ///< number of steps in the last event `substeps`
};

}  // namespace alidade::internal
