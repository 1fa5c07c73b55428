// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/timeline.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "alidade/base/all_finite.h"
#include "alidade/base/error.h"
#include "alidade/base/number_text.h"

namespace alidade::internal {
namespace {

constexpr Timestamp kForever = std::numeric_limits<Timestamp>::max();

/// timeout_s in whole nanoseconds, at least one.
Timestamp TimeoutOf(double timeout_s) {
  constexpr double kBeyond = 9.2e9;  // what a Timestamp cannot hold
  return timeout_s < kBeyond ? std::max<Timestamp>(1, TimestampFromSeconds(timeout_s)) : kForever;
}

/// Why an input cannot be used; empty: it can.
std::string Defect(const Geometry& geometry, const std::vector<double>& value) {
  if (!AllFinite(value)) return "not finite";
  if (DistanceFrom(geometry, value.data()) > kUnitTolerance) return "not of unit length";
  return {};
}

/// max_dt_s in whole nanoseconds, at least one.
Timestamp LongestStep(double max_dt_s) {
  constexpr double kBeyond = 9.2e18;  // what a Timestamp cannot hold
  const double ns = std::round(1e9 * max_dt_s);
  return ns < kBeyond ? std::max<Timestamp>(1, static_cast<Timestamp>(ns)) : kForever;
}

}  // namespace

Timeline::Timeline(const Problem& problem, const std::vector<StreamInfo>& streams, double max_dt_s)
    : max_dt_s_(max_dt_s), longest_(LongestStep(max_dt_s)) {
  if (problem.initial_time_s) start_ = TimestampFromSeconds(*problem.initial_time_s);
  for (std::size_t i = 0; i < problem.motions.size(); ++i) {
    const MotionBinding& motion = problem.motions[i];
    if (!motion.model->has_input()) continue;
    Held& held = held_.emplace_back();
    held.motion = i;
    held.name = motion.name;
    held.binding = motion.input;
    held.geometry = motion.model->input().geometry;
    held.timeout = TimeoutOf(motion.input.timeout_s);
    held.neutral.resize(static_cast<std::size_t>(held.geometry.ambient));
    held.geometry.Identity(held.neutral.data());
    held.value = held.neutral;
    const auto stream = std::ranges::find(streams, motion.input.stream, &StreamInfo::name);
    if (stream != streams.end()) {
      ALIDADE_EXPECTS(stream->size == held.geometry.ambient);
      held.stream = static_cast<int>(stream - streams.begin());
    }
  }
}

StepError Timeline::NextSubStep(Timestamp from, Timestamp to, std::vector<Event>& events,
                                SubStep& sub_step) {
  constexpr Timestamp kMostSteps = 1'000'000;
  sub_step.start = from;
  sub_step.end = to;
  for (const Held& held : held_) {  // u changes where one stops acting
    if (Acts(held, from)) sub_step.end = std::min(sub_step.end, held.until);
  }
  Timestamp elapsed = 0;
  const bool overflow = __builtin_sub_overflow(sub_step.end, from, &elapsed);
  sub_step.steps = overflow ? 0 : (elapsed <= longest_ ? 1 : (elapsed - 1) / longest_ + 1);
  if (overflow || sub_step.steps > kMostSteps) {
    return {"too_many_substeps", "a gap of " + RoundedText(Seconds(sub_step.end) - Seconds(from)) +
                                     " s would need more than " +
                                     RoundedText(static_cast<double>(kMostSteps)) + " steps of " +
                                     RoundedText(max_dt_s_) + " s"};
  }
  sub_step.dt_s = Seconds(elapsed);
  if (sub_step.steps > 1) sub_step.dt_s /= static_cast<double>(sub_step.steps);
  if (sub_step.steps >= 2 * most_steps_) {
    events.push_back({from, "substeps",
                      "a gap of " + RoundedText(Seconds(elapsed)) +
                          " s, longer than max_dt_s = " + RoundedText(max_dt_s_) +
                          ", is stepped in " + std::to_string(sub_step.steps) + " equal parts"});
    most_steps_ = sub_step.steps;
  }
  return {};
}

std::string Timeline::WhyNone(const Held& held) {
  const std::string input =
      "control input of '" + held.name + "' from stream '" + held.binding.stream + "'";
  if (held.timestamp == kNoTimestamp) return "no " + input + " has come yet: steps with u = 0";
  return "the " + input + " is older than " + NumberText(held.binding.timeout_s) +
         " s: steps with u = 0";
}

std::span<const double> Timeline::Input(std::size_t motion, Timestamp from,
                                        std::vector<Event>& events) {
  const auto found = std::ranges::find(held_, motion, &Held::motion);
  if (found == held_.end()) return {};
  if (Acts(*found, from)) {
    found->stale_noted = false;
    return found->value;
  }
  if (!found->stale_noted) events.push_back({from, "input_stale", WhyNone(*found)});
  found->stale_noted = true;
  return found->neutral;
}

void Timeline::UseInputs(Timestamp from, Motions& motions, std::vector<Event>& events) {
  if (!has_inputs()) return;
  for (std::size_t i = 0; i < motions.steps().size(); ++i) {
    Motions::Step& step = motions.steps()[i];
    if (!step.active) continue;
    const std::span<const double> u = Input(i, from, events);
    step.u.assign(u.begin(), u.end());
  }
}

[[gnu::noinline]] void Timeline::TakeInputs(const Frame& frame, UpdateReport& report) {
  for (Held& held : held_) {
    for (const Measurement& m : frame.measurements) {
      if (m.stream != held.stream || frame.timestamp < held.timestamp) continue;
      ALIDADE_EXPECTS(m.values.size() == held.value.size());
      const std::string defect = Defect(held.geometry, m.values);
      if (!defect.empty() && !held.refusal_noted) {
        report.events.push_back({frame.timestamp, "input_refused",
                                 "a control input of '" + held.name + "' from stream '" +
                                     held.binding.stream + "' is " + defect +
                                     ": the one before it goes on acting"});
      }
      held.refusal_noted = !defect.empty();
      if (held.refusal_noted) continue;
      std::ranges::copy(m.values, held.value.begin());
      held.geometry.Normalise(held.value.data());
      held.timestamp = frame.timestamp;
      if (__builtin_add_overflow(frame.timestamp, held.timeout, &held.until)) held.until = kForever;
      report.inputs.push_back(static_cast<int>(held.motion));
    }
  }
}

}  // namespace alidade::internal
