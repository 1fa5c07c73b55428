// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/filter/control_inputs.h"
#include "alidade/filter/motions.h"

namespace alidade::internal {

/// How a filter gets from one timestamp to another: in pieces over which no control input changes,
/// each in equal steps of at most max_dt_s. A copy is a snapshot.
class Timeline {
 public:
  /// Equal steps from `start` to `end`.
  struct Piece {
    Timestamp start = 0, end = 0;
    Timestamp steps = 0;
    double dt_s = 0.0;
    /// The end of step `i`, counted from 1.
    Timestamp EndOf(Timestamp i) const {
      return i == steps ? end : start + (end - start) / steps * i;
    }
  };

  Timeline(const System& system, const std::vector<StreamInfo>& streams, double max_dt_s)
      : inputs_(system, streams), max_dt_s_(max_dt_s) {}

  /// The first piece of the way from `from` to `to`, later. A piece of at least twice as many steps
  /// as any noted before is noted as the event `substeps`. What is not empty: it would need too
  /// many.
  Trouble First(Timestamp from, Timestamp to, std::vector<Event>& events, Piece& piece);

  /// Gives the motion models that move their control inputs from `from` on.
  void UseInputs(Timestamp from, Motions& motions, std::vector<Event>& events);

  ControlInputs& inputs() { return inputs_; }
  double max_dt_s() const { return max_dt_s_; }

 private:
  ControlInputs inputs_;
  double max_dt_s_;
  Timestamp most_steps_ = 1;  ///< of a piece, as far as they were noted
};

}  // namespace alidade::internal
