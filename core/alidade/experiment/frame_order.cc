// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/frame_order.h"

#include <algorithm>
#include <iterator>
#include <numeric>
#include <tuple>
#include <type_traits>
#include <utility>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/experiment/accepted_data.h"

namespace alidade::internal {
namespace {

/// ` in FILE:LINE`, where the source knows.
std::string In(const Place& place) {
  const std::string text = ToString(Place{place.file, place.line, 0});
  return text.empty() ? "" : " in " + text;
}

}  // namespace

FrameOrder::FrameOrder(Experiment& experiment, Check check)
    : experiment_(experiment), check_(std::move(check)), guide_(experiment) {
  if (experiment.out_of_sequence.policy != OutOfSequence::kRollback) return;
  for (const EstimatorSpec& named : experiment.estimators) {
    std::optional<Snapshots>& snapshots = snapshots_.emplace_back();
    if (!named.estimator->offline()) snapshots.emplace(*named.estimator);
  }
}

FrameOrder::~FrameOrder() {
  for (std::size_t e = 0; e < snapshots_.size(); ++e) {
    if (!snapshots_[e]) continue;
    experiment_.estimators[e].estimator = std::move(*snapshots_[e]).ReleasedEstimator();
  }
}

bool FrameOrder::Next(SourceFrame& frame) {
  if (experiment_.out_of_sequence.policy == OutOfSequence::kReject) {
    if (!experiment_.source->Next(frame)) return false;
    check_(frame);
    Accept(frame);
    return true;
  }
  while (!ended_ && (held_.empty() || !IsTooLate(held_.front().frame.timestamp))) {
    try {
      Receive();
    } catch (...) {
      failure_ = std::current_exception();
      ended_ = true;
    }
  }
  if (held_.empty()) {
    if (failure_) std::rethrow_exception(failure_);
    return false;
  }
  frame = std::move(held_.front().frame);
  held_.pop_front();
  for (std::optional<Snapshots>& snapshots : snapshots_) {
    if (snapshots) snapshots->Release();
  }
  return true;
}

const ProcessedFrame* FrameOrder::processed(std::size_t estimator) const {
  if (estimator >= snapshots_.size() || !snapshots_[estimator]) return nullptr;
  return &snapshots_[estimator]->released();
}

/// Whether a frame of this timestamp, were it to come now, would come too late.
bool FrameOrder::IsTooLate(Timestamp timestamp) const {
  return experiment_.out_of_sequence.window &&
         Lag(newest_, timestamp) > *experiment_.out_of_sequence.window;
}

/// Counts the frame; false where it is to be dropped.
bool FrameOrder::Accept(const Frame& frame) {
  if (frame.timestamp >= newest_) {
    newest_ = frame.timestamp;
    return true;
  }
  const Timestamp lag = Lag(newest_, frame.timestamp);
  ++arrivals_.out_of_sequence;
  arrivals_.longest_lag = std::max(arrivals_.longest_lag, lag);
  if (!IsTooLate(frame.timestamp)) return true;
  ++arrivals_.dropped;
  events_.push_back({frame.timestamp, "out_of_sequence",
                     "a frame " + Names(frame) + "came " + SecondsText(lag) +
                         " behind the newest, beyond the window of " +
                         SecondsText(*experiment_.out_of_sequence.window) + ": dropped"});
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
void FrameOrder::Receive() {
  Held received;
  ended_ = !experiment_.source->Next(received.frame);
  if (ended_) return;
  check_(received.frame);
  received.places.assign(received.frame.measurements.size(), experiment_.source->place());
  if (!Accept(received.frame)) return;
  const std::size_t at = Insert(std::move(received));
  if (experiment_.out_of_sequence.policy != OutOfSequence::kRollback) return;
  try {
    Replay(at);
  } catch (...) {
    held_.resize(at);  // what came before is as it was
    throw;
  }
}

/// Where the frame is now in held_.
std::size_t FrameOrder::Insert(Held&& received) {
  const auto timestamp = [](const Held& held) { return held.frame.timestamp; };
  const auto at = std::ranges::lower_bound(held_, received.frame.timestamp, {}, timestamp);
  const auto index = static_cast<std::size_t>(at - held_.begin());
  if (at == held_.end() || at->frame.timestamp != received.frame.timestamp) {
    held_.insert(at, std::move(received));
  } else {
    CheckMerge(*at, received.frame);
    Merge(*at, std::move(received));
    ++arrivals_.merged;
  }
  return index;
}

/// Throws where both have a measurement of one stream, or another value of a truth.
void FrameOrder::CheckMerge(const Held& held, const SourceFrame& part) const {
  const Source& source = *experiment_.source;
  const SourceFrame& whole = held.frame;
  const auto fail = [&](const std::string& what, const std::string& expected) {
    throw Error(
        ExitCode::kBadData,
        ErrorLine(source.place(), {}, what + " at t = " + SecondsText(whole.timestamp), expected));
  };
  for (const Measurement& m : part.measurements) {
    const auto same = [&](const Measurement& other) {
      return other.stream == m.stream && other.landmark == m.landmark;
    };
    const auto first = std::ranges::find_if(whole.measurements, same);
    if (first == whole.measurements.end()) continue;
    const auto index = static_cast<std::size_t>(first - whole.measurements.begin());
    fail("stream '" + source.streams()[static_cast<std::size_t>(m.stream)].name + "' twice",
         "one measurement at a timestamp; the first is" + In(held.places[index]));
  }
  for (std::size_t t = 0; t < std::min(whole.truth.size(), part.truth.size()); ++t) {
    if (part.truth[t].empty() || whole.truth[t].empty() || part.truth[t] == whole.truth[t])
      continue;
    fail("another value of truth '" + source.truths()[t].name + "'", "one at a timestamp");
  }
}

/// Puts the measurements of both into the order of the config, and the truths that one of the two
/// lacks.
void FrameOrder::Merge(Held& held, Held&& received) const {
  SourceFrame &whole = held.frame, &part = received.frame;
  const auto key = [this](const Measurement& one) {
    const std::vector<int>& ranks = experiment_.out_of_sequence.ranks;
    const auto stream = static_cast<std::size_t>(one.stream);
    return std::tuple(stream < ranks.size() ? ranks[stream] : 0, one.stream, one.landmark);
  };
  std::ranges::move(part.measurements, std::back_inserter(whole.measurements));
  held.places.insert(held.places.end(), received.places.begin(), received.places.end());
  std::vector<std::size_t> order(whole.measurements.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return key(whole.measurements[i]); });
  const auto sorted = [&](auto& list) {
    std::remove_reference_t<decltype(list)> ordered;
    for (const std::size_t i : order) ordered.push_back(std::move(list[i]));
    list = std::move(ordered);
  };
  sorted(whole.measurements);
  sorted(held.places);
  whole.truth.resize(std::max(whole.truth.size(), part.truth.size()));
  for (std::size_t t = 0; t < part.truth.size(); ++t) {
    if (whole.truth[t].empty()) whole.truth[t] = std::move(part.truth[t]);
  }
}

/// Gives the frames held from index `from` on to the estimators, after what came before them.
void FrameOrder::Replay(std::size_t from) {
  for (std::size_t e = 0; e < experiment_.estimators.size(); ++e) {
    if (!snapshots_[e]) continue;
    EstimatorSpec& named = experiment_.estimators[e];
    std::vector<Frame> frames;
    for (std::size_t i = from; i < held_.size(); ++i) {
      frames.push_back(named.accepted_by < 0 ? held_[i].frame : Accepted(i, named.accepted_by));
    }
    snapshots_[e]->Replace(from, std::move(frames), named.estimator);
  }
}

/// The frame held at `index` as an estimator sees it that uses what estimator `by` accepted.
Frame FrameOrder::Accepted(std::size_t index, int by) const {
  const auto filter = static_cast<std::size_t>(by);
  const ProcessedFrame& processed = snapshots_[filter]->frames()[index];
  return AcceptedOf(processed.frame, experiment_.source->streams(),
                    experiment_.estimators[filter].problem, processed.report);
}

}  // namespace alidade::internal
