// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/timeline.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "alidade/base/number_text.h"

namespace alidade::internal {
namespace {

/// Number of equal parts in which a gap of `elapsed` > 0 is stepped: at most max_dt_s each, to
/// whole ns, and at least 1 ns.
Timestamp StepParts(Timestamp elapsed, double max_dt_s) {
  constexpr double kBeyond = 9.2e18;  // what a Timestamp cannot hold
  const double ns = std::round(1e9 * max_dt_s);
  const Timestamp longest = ns < kBeyond ? std::max<Timestamp>(1, static_cast<Timestamp>(ns))
                                         : std::numeric_limits<Timestamp>::max();
  return (elapsed - 1) / longest + 1;
}

/// Six significant digits.
std::string Rounded(double value) { return RoundedText(value, 6); }

}  // namespace

Trouble Timeline::First(Timestamp from, Timestamp to, std::vector<Event>& events, Piece& piece) {
  constexpr Timestamp kMostSteps = 1'000'000;
  piece.start = from;
  piece.end = inputs_.StepEnd(from, to);
  Timestamp elapsed = 0;
  const bool overflow = __builtin_sub_overflow(piece.end, from, &elapsed);
  piece.steps = overflow ? 0 : StepParts(elapsed, max_dt_s_);
  if (overflow || piece.steps > kMostSteps) {
    return {"too_many_substeps", "a gap of " + Rounded(Seconds(piece.end) - Seconds(from)) +
                                     " s would need more than " +
                                     Rounded(static_cast<double>(kMostSteps)) + " steps of " +
                                     Rounded(max_dt_s_) + " s"};
  }
  piece.dt_s = Seconds(elapsed) / static_cast<double>(piece.steps);
  if (piece.steps >= 2 * most_steps_) {
    events.push_back({from, "substeps",
                      "a gap of " + Rounded(Seconds(elapsed)) +
                          " s, longer than max_dt_s = " + Rounded(max_dt_s_) + ", is stepped in " +
                          std::to_string(piece.steps) + " equal parts"});
    most_steps_ = piece.steps;
  }
  return {};
}

void Timeline::UseInputs(Timestamp from, Motions& motions, std::vector<Event>& events) {
  if (inputs_.empty()) return;
  for (std::size_t i = 0; i < motions.steps().size(); ++i) {
    Motions::Step& step = motions.steps()[i];
    if (!step.active) continue;
    const std::span<const double> u = inputs_.Use(i, from, events);
    step.u.assign(u.begin(), u.end());
  }
}

}  // namespace alidade::internal
