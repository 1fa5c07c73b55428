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

/// Returns timeout_s in whole nanoseconds, at least 1 ns.
Timestamp TimeoutOf(double timeout_s) {
  constexpr double kLimit_s = 9.2e9;  // longer times would overflow a Timestamp
  return timeout_s < kLimit_s ? std::max<Timestamp>(1, TimestampFromSeconds(timeout_s)) : kForever;
}

/// Returns the reason why an input cannot be used, or "" if it can be used.
std::string Defect(const Geometry& geometry, const std::vector<double>& value) {
  if (!AllFinite(value)) return "is not finite";
  if (DistanceFrom(geometry, value.data()) > kUnitTolerance) return "does not have unit length";
  return {};
}

/// Returns max_dt_s in whole nanoseconds, at least 1 ns.
Timestamp MaxStep(double max_dt_s) {
  constexpr double kLimit_ns = 9.2e18;  // longer times would overflow a Timestamp
  const double ns = std::round(1e9 * max_dt_s);
  return ns < kLimit_ns ? std::max<Timestamp>(1, static_cast<Timestamp>(ns)) : kForever;
}

}  // namespace

Timeline::Timeline(const Problem& problem, const std::vector<StreamInfo>& streams, double max_dt_s)
    : max_dt_s_(max_dt_s), max_dt_(MaxStep(max_dt_s)) {
  if (problem.initial_time_s) start_ = TimestampFromSeconds(*problem.initial_time_s);
  for (std::size_t i = 0; i < problem.motions.size(); ++i) {
    const MotionBinding& motion = problem.motions[i];
    if (!motion.model->has_input()) continue;
    StoredInput& input = inputs_.emplace_back();
    input.motion = i;
    input.name = motion.name;
    input.binding = motion.input;
    input.geometry = motion.model->input().geometry;
    input.timeout = TimeoutOf(motion.input.timeout_s);
    input.neutral = input.geometry.Identity();
    input.value = input.neutral;
    const auto stream = std::ranges::find(streams, motion.input.stream, &StreamInfo::name);
    if (stream != streams.end()) {
      ALIDADE_EXPECTS(stream->size == input.geometry.ambient);
      input.stream = static_cast<int>(stream - streams.begin());
    }
  }
}

StepError Timeline::NextSubStep(Timestamp start, Timestamp end, std::vector<Event>& events,
                                SubStep& sub_step) {
  constexpr Timestamp kMaxSteps = 1'000'000;
  sub_step.start = start;
  sub_step.end = end;
  // u changes when an input expires, so the sub-step ends at that time.
  for (const StoredInput& input : inputs_) {
    if (IsActive(input, start)) sub_step.end = std::min(sub_step.end, input.expiration);
  }
  Timestamp elapsed = 0;
  const bool overflow = __builtin_sub_overflow(sub_step.end, start, &elapsed);
  sub_step.steps = overflow ? 0 : (elapsed <= max_dt_ ? 1 : (elapsed - 1) / max_dt_ + 1);
  if (overflow || sub_step.steps > kMaxSteps) {
    return {EventKind::kTooManySubsteps,
            "a gap of " + RoundedText(Seconds(sub_step.end) - Seconds(start)) +
                " s needs more than " + RoundedText(static_cast<double>(kMaxSteps)) + " steps of " +
                RoundedText(max_dt_s_) + " s; increase max_dt_s"};
  }
  sub_step.dt_s = Seconds(elapsed);
  if (sub_step.steps > 1) sub_step.dt_s /= static_cast<double>(sub_step.steps);
  if (sub_step.steps >= 2 * max_reported_steps_) {
    events.push_back({start, EventKind::kSubsteps,
                      "a gap of " + RoundedText(Seconds(elapsed)) +
                          " s, longer than max_dt_s = " + RoundedText(max_dt_s_) +
                          ", is divided into " + std::to_string(sub_step.steps) + " equal steps"});
    max_reported_steps_ = sub_step.steps;
  }
  return {};
}

std::string Timeline::DescribeMissing(const StoredInput& input) {
  const std::string description =
      "control input of '" + input.name + "' from stream '" + input.binding.stream + "'";
  if (input.timestamp == kNoTimestamp) {
    return "no " + description + " has arrived yet: the motion model uses u = 0";
  }
  return "the " + description + " is older than " + NumberText(input.binding.timeout_s) +
         " s: the motion model uses u = 0";
}

std::span<const double> Timeline::Input(std::size_t motion, Timestamp start,
                                        std::vector<Event>& events) {
  const auto found = std::ranges::find(inputs_, motion, &StoredInput::motion);
  if (found == inputs_.end()) return {};
  if (IsActive(*found, start)) {
    found->stale_reported = false;
    return found->value;
  }
  if (!found->stale_reported)
    events.push_back({start, EventKind::kInputStale, DescribeMissing(*found)});
  found->stale_reported = true;
  return found->neutral;
}

void Timeline::UseInputs(Timestamp start, Motions& motions, std::vector<Event>& events) {
  if (!has_inputs()) return;
  for (std::size_t i = 0; i < motions.steps().size(); ++i) {
    Motions::Step& step = motions.steps()[i];
    if (!step.active) continue;
    const std::span<const double> u = Input(i, start, events);
    step.u.assign(u.begin(), u.end());
  }
}

[[gnu::noinline]] void Timeline::TakeInputs(const Frame& frame, UpdateReport& report) {
  for (StoredInput& input : inputs_) {
    for (const Measurement& m : frame.measurements) {
      if (m.stream != input.stream || frame.timestamp < input.timestamp) continue;
      ALIDADE_EXPECTS(m.values.size() == input.value.size());
      const std::string defect = Defect(input.geometry, m.values);
      if (!defect.empty() && !input.refusal_reported) {
        report.events.push_back({frame.timestamp, EventKind::kInputRefused,
                                 "a control input of '" + input.name + "' from stream '" +
                                     input.binding.stream + "' " + defect +
                                     ": the previous input remains in use"});
      }
      input.refusal_reported = !defect.empty();
      if (input.refusal_reported) continue;
      std::ranges::copy(m.values, input.value.begin());
      input.geometry.Normalise(input.value.data());
      input.timestamp = frame.timestamp;
      if (__builtin_add_overflow(frame.timestamp, input.timeout, &input.expiration))
        input.expiration = kForever;
      report.inputs.push_back(static_cast<int>(input.motion));
    }
  }
}

}  // namespace alidade::internal
