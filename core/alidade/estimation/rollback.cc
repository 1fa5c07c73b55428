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
  released_.after = start.Clone();
  ALIDADE_EXPECTS(released_.after != nullptr);
}

void Snapshots::Replace(std::size_t first, std::vector<Frame> frames,
                        std::unique_ptr<Estimator>& estimator) {
  ALIDADE_EXPECTS(first <= frames_.size());
  std::unique_ptr<Estimator> earlier;
  if (first < frames_.size()) {
    earlier = (first == 0 ? released_ : frames_[first - 1]).after->Clone();
  }
  Estimator& current = earlier ? *earlier : *estimator;
  std::deque<ProcessedFrame> processed;
  for (Frame& frame : frames) {
    ProcessedFrame& next = processed.emplace_back();
    if (!current.failed()) next.report = current.Process(frame);
    next.frame = std::move(frame);
    next.after = current.Clone();
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
  const std::deque<ProcessedFrame>& kept = snapshots_.frames();
  const auto timestamp = [](const ProcessedFrame& one) { return one.frame.timestamp; };
  const auto later = std::ranges::upper_bound(kept, frame.timestamp, {}, timestamp);
  if (later != kept.end() && internal::Lag(timestamp(kept.back()), frame.timestamp) > window_) {
    return Refuse(std::move(frame));
  }
  const auto first = static_cast<std::size_t>(later - kept.begin());
  std::vector<Frame> frames{std::move(frame)};
  for (auto one = later; one != kept.end(); ++one) frames.push_back(one->frame);
  const std::size_t count = frames.size();
  snapshots_.Replace(first, std::move(frames), filter_);
  while (internal::Lag(timestamp(kept.back()), timestamp(kept.front())) > window_) {
    snapshots_.Release();
  }
  return {kept.end() - static_cast<std::ptrdiff_t>(count), kept.end()};
}

/// The report of a stale frame, by a copy of the filter.
Rollback::Processed Rollback::Refuse(Frame frame) {
  const Timestamp newest = snapshots_.frames().back().frame.timestamp;
  ProcessedFrame refused{std::move(frame), {}, filter_->Clone()};
  refused.report = refused.after->Process(refused.frame);
  refused.report.inputs.clear();
  refused.report.events = {
      {refused.frame.timestamp, "stale",
       "the frame at " + internal::SecondsText(refused.frame.timestamp) + " is " +
           internal::SecondsText(internal::Lag(newest, refused.frame.timestamp)) +
           " older than the newest, beyond the window of " + internal::SecondsText(window_) +
           ": its measurements are not used"}};
  refused.after = filter_->Clone();
  refused_.clear();
  refused_.push_back(std::move(refused));
  return {refused_.begin(), refused_.end()};
}

}  // namespace alidade
