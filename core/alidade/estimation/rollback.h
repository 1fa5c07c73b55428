// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstddef>
#include <deque>
#include <memory>
#include <vector>

#include "alidade/estimation/filter.h"

namespace alidade {

/// Processed frame, with its report and a copy of the estimator after the frame. An estimator that
/// has failed does not process further frames. The reports of these frames are empty.
struct ProcessedFrame {
  Frame frame;
  UpdateReport report;
  std::unique_ptr<Estimator> snapshot;
};

/// Latest frames of an estimator, each with a copy of the estimator after the frame
/// (Estimator::Clone). The class Rollback and the runs of experiments use it.
class Snapshots {
 public:
  /// Starts with a copy of an estimator before its first frame. ContractViolation if the estimator
  /// cannot be copied.
  explicit Snapshots(const Estimator& start);

  const std::deque<ProcessedFrame>& frames() const { return frames_; }
  /// Returns the frame that was released last. Before the first Release, the result contains the
  /// initial estimator, but no frame.
  const ProcessedFrame& released() const { return released_; }
  /// Restores the estimator from the copy before the frame with the index `first`. Then processes
  /// `frames`, which replace that frame and all later frames. If `first` is frames().size(),
  /// appends `frames`. If the estimator throws, the snapshots are unchanged. The estimator is then
  /// also unchanged, unless `first` is frames().size().
  void Replace(std::size_t first, std::vector<Frame> frames, std::unique_ptr<Estimator>& estimator);
  /// Releases the oldest frame, which can then no longer be replaced. ContractViolation if frames()
  /// is empty.
  void Release();
  /// Returns the copy of the estimator after released(). This object must not be used afterwards.
  std::unique_ptr<Estimator> ReleasedEstimator() && { return std::move(released_.snapshot); }

 private:
  ProcessedFrame released_;
  std::deque<ProcessedFrame> frames_;
};

/// Rollback for out-of-sequence measurements: a filter that accepts frames in any order and
/// processes them in the order of their timestamps.
///
/// Rollback stores the frames of the last `window_s` seconds, each with a copy of the filter after
/// the frame. If a new frame is older than the newest stored frame, the filter is restored from the
/// copy before the new frame. The new frame is then processed, and the later frames are processed
/// again. The resulting state is bit-identical to the state after processing the same frames in
/// order. Frames with equal timestamps are processed in their order of arrival. Rollback can be
/// moved, but not copied. A copy of filter() is an independent filter.
class Rollback {
 public:
  /// Frames that a call processed, in the order of their timestamps. The iterators are valid until
  /// the next call.
  class Processed {
   public:
    using Iterator = std::deque<ProcessedFrame>::const_iterator;

    Processed(const Iterator& begin, const Iterator& end) : begin_(begin), end_(end) {}
    Iterator begin() const { return begin_; }
    Iterator end() const { return end_; }
    std::size_t size() const { return static_cast<std::size_t>(end_ - begin_); }
    const ProcessedFrame& front() const { return *begin_; }

   private:
    Iterator begin_, end_;
  };

  /// Starts from a copy of `filter`. ContractViolation if window_s is negative or not a number.
  Rollback(const Filter& filter, double window_s);

  /// Processes the frame. Returns the frame, followed by the later frames that were processed
  /// again. A frame that is more than window_s older than the newest frame is rejected. The filter
  /// is then unchanged, UpdateReport::stale is true, and the report contains an event.
  Processed Process(Frame frame);
  /// Calls Process with the readings of one timestamp. Throws the same errors as Filter::Push. The
  /// filter is then unchanged.
  template <std::floating_point Seconds>
  Processed Push(Seconds t_s, const std::vector<Reading>& readings) = delete;
  Processed Push(Timestamp timestamp, const std::vector<Reading>& readings) {
    return Process(filter().MakeFrame(timestamp, readings));
  }
  /// Returns the filter after the newest frame. The reference is valid until the next call.
  const Filter& filter() const { return static_cast<const Filter&>(*filter_); }

 private:
  Processed Reject(Frame frame);

  Timestamp window_;
  std::unique_ptr<Estimator> filter_;  // the object is always a Filter
  Snapshots snapshots_;
  std::deque<ProcessedFrame> rejected_;  ///< the frame that was rejected last
};

namespace internal {

/// Returns newest - timestamp, or the largest Timestamp if the difference overflows. Requires
/// timestamp <= newest.
Timestamp Lag(Timestamp newest, Timestamp timestamp);

}  // namespace internal

}  // namespace alidade
