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

/// Divides the time between two timestamps into sub-steps during which no control input changes,
/// each of equal steps of at most max_dt_s. Control inputs are held until the next one (zero-order
/// hold).
///
///   u(t) = u_k   for t_k <= t < min(t_{k+1}, t_k + timeout)
///   u(t) = 0     for any other t: the neutral element of the input's geometry
///
///   symbol    unit         meaning
///   u_k       the model's  an input that was taken
///   t_k       s            timestamp of its frame
///   timeout   s            InputBinding::timeout_s
///
/// A copy is a snapshot.
class Timeline {
 public:
  /// Equal steps from `start` to `end`.
  struct SubStep {
    Timestamp start = 0, end = 0;
    Timestamp steps = 0;
    double dt_s = 0.0;
    /// The end of step `i`, counted from 1.
    Timestamp EndOf(Timestamp i) const {
      return i == steps ? end : start + (end - start) / steps * i;
    }
  };

  /// `streams` are the source's, in the order of Measurement::stream. ContractViolation where the
  /// stream of an input has another size than the model's input.
  Timeline(const Problem& problem, const std::vector<StreamInfo>& streams, double max_dt_s);

  /// The time of the priors, where nothing else sets it: initial_time_s, or the first frame's.
  Timestamp StartFor(const Frame& first) const { return start_.value_or(first.timestamp); }
  /// Computes the next sub-step from `from` towards `to`, which is later. If it has at least twice
  /// as many steps as any before, the event `substeps` reports it. Returns an error if it would
  /// need too many steps.
  StepError NextSubStep(Timestamp from, Timestamp to, std::vector<Event>& events,
                        SubStep& sub_step);

  /// Whether a model takes a control input.
  bool has_inputs() const { return !held_.empty(); }
  /// u (ambient) over the piece that starts at `from`, for Problem::motions[motion]; empty where it
  /// takes none. Where none acts, an event `input_stale`, once until one does. Good until the next
  /// TakeInputs.
  std::span<const double> Input(std::size_t motion, Timestamp from, std::vector<Event>& events);
  /// Sets the control inputs of the active motion models.
  void UseInputs(Timestamp from, Motions& motions, std::vector<Event>& events);
  /// Takes the inputs of a frame, which then act from its timestamp on, and lists them in
  /// `report.inputs`. One that is older than the one held is passed over; one that is not finite or
  /// not of unit length is refused, with an event `input_refused`, once until one is taken. Their
  /// noise is that of the model: a covariance that comes with one is not used.
  void TakeInputs(const Frame& frame, UpdateReport& report);

 private:
  struct Held {
    std::size_t motion = 0;
    std::string name;  ///< of the state entry
    InputBinding binding;
    Geometry geometry;
    int stream = -1;  ///< -1: the source has none of that name
    Timestamp timeout = 0;
    std::vector<double> value, neutral;
    Timestamp timestamp = kNoTimestamp;  ///< of the value
    Timestamp until = kNoTimestamp;      ///< when it stops acting
    bool stale_noted = false, refusal_noted = false;
  };
  static bool Acts(const Held& held, Timestamp at) { return at < held.until; }
  static std::string WhyNone(const Held& held);

  std::vector<Held> held_;  ///< of the models that take an input
  std::optional<Timestamp> start_;
  double max_dt_s_;
  Timestamp longest_;         ///< max_dt_s, in whole ns and at least one
  Timestamp most_steps_ = 1;  ///< of a piece, as far as they were noted
};

}  // namespace alidade::internal
