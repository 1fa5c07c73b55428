// SPDX-License-Identifier: Apache-2.0
#include "reorder.h"

#include <algorithm>
#include <limits>
#include <tuple>
#include <utility>

#include "accepted.h"
#include "number_text.h"
#include "text_table.h"

namespace alidade::internal {
namespace {

/// How far `stamp` is behind `newest`, which is not before it; the longest there is where that
/// does not fit.
Stamp Behind(Stamp newest, Stamp stamp) {
  Stamp lag = 0;
  return __builtin_sub_overflow(newest, stamp, &lag) ? std::numeric_limits<Stamp>::max() : lag;
}

std::string InSeconds(Stamp stamp) { return FixedText(Seconds(stamp), 6) + " s"; }

/// ` in FILE:LINE`, where the source knows.
std::string In(const Place& place) {
  const std::string text = ToString(Place{place.file, place.line, 0});
  return text.empty() ? "" : " in " + text;
}

}  // namespace

FrameOrder::FrameOrder(Experiment& experiment, Check check)
    : experiment_(experiment), check_(check) {
  if (experiment.time.order != TimeOrder::kRewind) return;
  for (const NamedEstimator& named : experiment.estimators) {
    Passed& before = left_.passed.emplace_back();
    if (named.estimator->offline()) continue;
    before.after = named.estimator->Save();
    ALIDADE_EXPECTS(before.after != nullptr);
  }
}

bool FrameOrder::Next(Frame& frame) {
  if (experiment_.time.order == TimeOrder::kReject) {
    if (!experiment_.source->Next(frame)) return false;
    check_(frame, *experiment_.source);
    Accept(frame);
    return true;
  }
  while (!ended_ && (held_.empty() || !IsBeyond(held_.front().frame.stamp))) {
    try {
      Arrive();
    } catch (...) {
      failure_ = std::current_exception();
      ended_ = true;
    }
  }
  if (held_.empty()) {
    if (failure_) std::rethrow_exception(failure_);
    return false;
  }
  left_ = std::move(held_.front());
  held_.pop_front();
  std::swap(frame, left_.frame);
  return true;
}

const Passed* FrameOrder::passed(std::size_t estimator) const {
  if (estimator >= left_.passed.size()) return nullptr;
  const Passed& one = left_.passed[estimator];
  return one.after != nullptr || one.failed ? &one : nullptr;
}

/// Whether a frame of this stamp, were it to come now, would come too late.
bool FrameOrder::IsBeyond(Stamp stamp) const {
  return experiment_.time.window && Behind(newest_, stamp) > *experiment_.time.window;
}

/// Counts the frame; false where it is to be dropped.
bool FrameOrder::Accept(const Frame& frame) {
  if (frame.stamp >= newest_) {
    newest_ = frame.stamp;
    return true;
  }
  const Stamp lag = Behind(newest_, frame.stamp);
  ++arrivals_.late;
  arrivals_.longest_lag = std::max(arrivals_.longest_lag, lag);
  if (!IsBeyond(frame.stamp)) return true;
  ++arrivals_.dropped;
  events_.push_back({frame.stamp, "late",
                     "a frame " + Names(frame) + "came " + InSeconds(lag) +
                         " behind the newest, beyond the window of " +
                         InSeconds(*experiment_.time.window) + ": dropped"});
  return false;
}

std::string FrameOrder::Names(const Frame& frame) const {
  std::vector<std::string> names;
  for (const Measurement& m : frame.measurements) {
    const std::string& name =
        experiment_.source->streams()[static_cast<std::size_t>(m.stream)].name;
    if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  }
  return names.empty() ? "" : "of " + Join(names) + ' ';
}

/// Takes a frame from the source.
void FrameOrder::Arrive() {
  Held arrived;
  ended_ = !experiment_.source->Next(arrived.frame);
  if (ended_) return;
  check_(arrived.frame, *experiment_.source);
  arrived.places.assign(arrived.frame.measurements.size(), experiment_.source->place());
  const bool is_newest = arrived.frame.stamp > newest_;
  if (!Accept(arrived.frame)) return;
  const std::size_t at = Insert(std::move(arrived));
  if (experiment_.time.order != TimeOrder::kRewind) return;
  try {
    Replay(at, is_newest);
  } catch (...) {
    held_.resize(at);  // what came before is as it was
    throw;
  }
}

/// Where the frame is now in held_.
std::size_t FrameOrder::Insert(Held&& arrived) {
  const auto stamp = [](const Held& held) { return held.frame.stamp; };
  const auto at = std::ranges::lower_bound(held_, arrived.frame.stamp, {}, stamp);
  const auto index = static_cast<std::size_t>(at - held_.begin());
  if (at == held_.end() || at->frame.stamp != arrived.frame.stamp) {
    held_.insert(at, std::move(arrived));
  } else {
    ++arrivals_.merged;
    Merge(*at, std::move(arrived));
  }
  return index;
}

/// Puts the measurements of both into the order of the config, and the truths that one of the two
/// lacks.
void FrameOrder::Merge(Held& held, Held&& arrived) const {
  const Source& source = *experiment_.source;
  const auto fail = [&](const Place& place, const std::string& what, const std::string& expected) {
    throw Error(ExitCode::kBadData,
                ErrorLine(place, {}, what + " at t = " + InSeconds(held.frame.stamp), expected));
  };
  const Place place = source.place();
  Frame &whole = held.frame, &part = arrived.frame;
  for (Measurement& m : part.measurements) {
    const auto same = [&](const Measurement& other) {
      return other.stream == m.stream && other.landmark == m.landmark;
    };
    const auto first = std::ranges::find_if(whole.measurements, same);
    if (first != whole.measurements.end()) {
      const auto index = static_cast<std::size_t>(first - whole.measurements.begin());
      fail(place,
           "stream '" + source.streams()[static_cast<std::size_t>(m.stream)].name + "' twice",
           "one measurement at a stamp; the first is" + In(held.places[index]));
    }
  }
  for (Measurement& m : part.measurements) {
    const auto key = [this](const Measurement& one) {
      const std::vector<int>& ranks = experiment_.time.ranks;
      const auto stream = static_cast<std::size_t>(one.stream);
      return std::tuple(stream < ranks.size() ? ranks[stream] : 0, one.stream, one.landmark);
    };
    const auto at = std::ranges::upper_bound(whole.measurements, key(m), {}, key);
    held.places.insert(held.places.begin() + (at - whole.measurements.begin()), place);
    whole.measurements.insert(at, std::move(m));
  }
  whole.truth.resize(std::max(whole.truth.size(), part.truth.size()));
  for (std::size_t t = 0; t < part.truth.size(); ++t) {
    if (part.truth[t].empty() || part.truth[t] == whole.truth[t]) continue;
    if (!whole.truth[t].empty()) {
      fail(place, "another value of truth '" + source.truths()[t].name + "'", "one at a stamp");
    }
    whole.truth[t] = std::move(part.truth[t]);
  }
}

/// Gives the frames held from index `from` on to the estimators, after what came before them.
void FrameOrder::Replay(std::size_t from, bool is_newest) {
  for (std::size_t i = from; i < held_.size(); ++i) {
    held_[i].passed.clear();
    held_[i].passed.resize(experiment_.estimators.size());
  }
  for (std::size_t e = 0; e < experiment_.estimators.size(); ++e) {
    Estimator& estimator = *experiment_.estimators[e].estimator;
    if (estimator.offline()) continue;
    const Passed* before = &(from == 0 ? left_ : held_[from - 1]).passed[e];
    if (!is_newest && !before->failed) estimator.Restore(*before->after);
    for (std::size_t i = from; i < held_.size(); ++i) {
      Passed& passed = held_[i].passed[e];
      if (before->failed) {
        passed.failed = true;
        passed.diverged = before->diverged;
      } else {
        const int by = experiment_.estimators[e].accepted_by;
        passed = Process(estimator, by < 0 ? held_[i].frame : Accepted(held_[i], by));
      }
      before = &passed;
    }
  }
}

/// The frame as an estimator sees it that uses what estimator `by` accepted.
Frame FrameOrder::Accepted(const Held& held, int by) const {
  const auto index = static_cast<std::size_t>(by);
  return AcceptedOf(held.frame, experiment_.source->streams(), experiment_.estimators[index].system,
                    held.passed[index].report);
}

Passed FrameOrder::Process(Estimator& estimator, const Frame& frame) const {
  Passed passed;
  passed.report = estimator.Process(frame);
  passed.after = estimator.Save();
  passed.failed = estimator.failed();
  passed.diverged = estimator.diverged();
  return passed;
}

}  // namespace alidade::internal
