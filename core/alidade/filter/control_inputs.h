// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "alidade/filter/update_report.h"
#include "alidade/system/system.h"

namespace alidade {

/// The control inputs of a system's motion models, held from one to the next (zero-order hold).
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
class ControlInputs {
 public:
  /// `streams` are the source's, in the order of Measurement::stream. ContractViolation where the
  /// stream of an input has another size than the model's input.
  ControlInputs(const System& system, const std::vector<StreamInfo>& streams);

  /// Whether no model takes one.
  bool empty() const { return held_.empty(); }
  /// The end of a step that starts at `from` and is to end at `to`, or before where u changes.
  Timestamp StepEnd(Timestamp from, Timestamp to) const;
  /// Whether all models have an input that acts from `from` to `to`.
  bool AllAct(Timestamp from, Timestamp to) const;
  /// u (ambient) from `from` to StepEnd, for System::motions[motion]; empty where it takes none.
  /// Where none acts, an event `input_stale`, once until one does. Good until the next Take.
  std::span<const double> Use(std::size_t motion, Timestamp from, std::vector<Event>& events);
  /// Takes the inputs of a frame, which then act from its timestamp on, and lists them in
  /// `report.inputs`. One that is older than the one held is passed over; one that is not finite or
  /// not of unit length is refused, with an event `input_refused`, once until one is taken. Their
  /// noise is that of the model: a covariance that comes with one is not used.
  void Take(const Frame& frame, UpdateReport& report);

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

  std::vector<Held> held_;  ///< of the models that take one
};

}  // namespace alidade
