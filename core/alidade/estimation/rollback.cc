// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/rollback.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <utility>

#include "alidade/base/error.h"
#include "alidade/base/number_text.h"

namespace alidade {

Timestamp internal::Lag(Timestamp newest, Timestamp timestamp) {
  Timestamp lag = 0;
  return __builtin_sub_overflow(newest, timestamp, &lag) ? std::numeric_limits<Timestamp>::max()
                                                         : lag;
}

Snapshots::Snapshots(const Estimator& start) {
  released_.snapshot = start.Clone();
  ALIDADE_EXPECTS(released_.snapshot != nullptr);
}

void Snapshots::Replace(std::size_t first, std::vector<Frame> frames,
                        std::unique_ptr<Estimator>& estimator) {
  ALIDADE_EXPECTS(first <= frames_.size());
  std::unique_ptr<Estimator> earlier;
  if (first < frames_.size()) {
    earlier = (first == 0 ? released_ : frames_[first - 1]).snapshot->Clone();
  }
  Estimator& current = earlier ? *earlier : *estimator;
  std::deque<ProcessedFrame> processed;
  for (Frame& frame : frames) {
    ProcessedFrame& next = processed.emplace_back();
    if (!current.failed()) next.report = current.Process(frame);
    next.frame = std::move(frame);
    next.snapshot = current.Clone();
  }
  if (earlier) estimator = std::move(earlier);
  frames_.erase(frames_.begin() + static_cast<std::ptrdiff_t>(first), frames_.end());
  std::ranges::move(processed, std::back_inserter(frames_));
}

void Snapshots::Release() {
  ALIDADE_EXPECTS(!frames_.empty());
  released_ = std::move(frames_.front());
  frames_.pop_front();
}

Rollback::Rollback(const Filter& filter, double window_s)
    : window_(TimestampFromSeconds(window_s)), filter_(filter.Clone()), snapshots_(filter) {
  ALIDADE_EXPECTS(window_ >= 0);
}

Rollback::Processed Rollback::Process(Frame frame) {
  const std::deque<ProcessedFrame>& window = snapshots_.frames();
  const auto timestamp = [](const ProcessedFrame& entry) { return entry.frame.timestamp; };
  const auto later = std::ranges::upper_bound(window, frame.timestamp, {}, timestamp);
  if (later != window.end() && internal::Lag(timestamp(window.back()), frame.timestamp) > window_) {
    return Reject(std::move(frame));
  }
  const auto first = static_cast<std::size_t>(later - window.begin());
  std::vector<Frame> frames{std::move(frame)};
  for (auto entry = later; entry != window.end(); ++entry) frames.push_back(entry->frame);
  const std::size_t count = frames.size();
  snapshots_.Replace(first, std::move(frames), filter_);
  while (internal::Lag(timestamp(window.back()), timestamp(window.front())) > window_) {
    snapshots_.Release();
  }
  return {window.end() - static_cast<std::ptrdiff_t>(count), window.end()};
}

/// Returns the report of a stale frame. A copy of the filter creates the report.
Rollback::Processed Rollback::Reject(Frame frame) {
  const Timestamp newest = snapshots_.frames().back().frame.timestamp;
  ProcessedFrame rejected{std::move(frame), {}, filter_->Clone()};
  rejected.report = rejected.snapshot->Process(rejected.frame);
  rejected.report.inputs.clear();
  rejected.report.events = {
      {rejected.frame.timestamp, EventKind::kStale,
       "the frame at " + internal::SecondsText(rejected.frame.timestamp) + " is " +
           internal::SecondsText(internal::Lag(newest, rejected.frame.timestamp)) +
           " older than the newest frame, which exceeds the window of " +
           internal::SecondsText(window_) + ": the measurements of this frame are not used"}};
  rejected.snapshot = filter_->Clone();
  rejected_.clear();
  rejected_.push_back(std::move(rejected));
  return {rejected_.begin(), rejected_.end()};
}

}  // namespace alidade
