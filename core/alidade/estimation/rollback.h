// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstddef>
#include <deque>
#include <memory>
#include <vector>

#include "alidade/estimation/filter.h"

namespace alidade {

/// A frame, its report, and the estimator as it was after it. An estimator that has failed takes no
/// more frames: their reports are empty.
struct ProcessedFrame {
  Frame frame;
  UpdateReport report;
  std::unique_ptr<Estimator> after;
};

/// The frames of an estimator since a state to which it can go back, with a copy of it after each
/// (Estimator::Clone). The rollback of programs (Rollback) and of runs.
class Snapshots {
 public:
  /// Of an estimator as it is before its first frame. ContractViolation if it cannot be copied.
  explicit Snapshots(const Estimator& start);

  const std::deque<ProcessedFrame>& frames() const { return frames_; }
  /// The last frame that was released; before the first, the state at the start with no frame.
  const ProcessedFrame& released() const { return released_; }
  /// Takes the estimator back to before the frame of index `first`, and processes `frames` in place
  /// of that one and of all after it. If `first` is frames().size(), they follow the last. If the
  /// estimator throws, nothing has changed, except the estimator if `frames` follow the last.
  void Replace(std::size_t first, std::vector<Frame> frames, std::unique_ptr<Estimator>& estimator);
  /// Releases the oldest frame: the estimator goes back at most to after it. ContractViolation if
  /// there is none.
  void Release();
  /// The copy of the estimator after released(), which ends these snapshots.
  std::unique_ptr<Estimator> ReleasedEstimator() && { return std::move(released_.after); }

 private:
  ProcessedFrame released_;
  std::deque<ProcessedFrame> frames_;
};

/// Late measurements by rollback: a filter that takes frames in the order in which they come, and
/// uses each in the order of the timestamps.
///
/// It keeps the frames of the last `window_s` seconds, with a copy of the filter after each. For a
/// frame that is older than the newest, the filter goes back to the copy before it, and processes
/// it and those after it again. Its state is then, to the last bit, that of the same frames in
/// order; of frames of equal timestamps the order in which they came counts. It can be moved, but
/// not copied; a copy of filter() goes on by itself.
class Rollback {
 public:
  /// The frames that a call processed, in the order of their timestamps. Good until the next call.
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

  /// Processes the frame: the frame itself, followed by the later ones that were processed again. A
  /// frame more than window_s behind the newest is refused: its report is `stale`, with an event,
  /// and nothing has changed.
  Processed Process(Frame frame);
  /// Process, of what came of one timestamp. Errors: those of Filter::Push; nothing has changed.
  template <std::floating_point Seconds>
  Processed Push(Seconds t_s, const std::vector<Reading>& readings) = delete;
  Processed Push(Timestamp timestamp, const std::vector<Reading>& readings) {
    return Process(filter().MakeFrame(timestamp, readings));
  }
  /// The filter after the newest frame. The reference is good until the next call.
  const Filter& filter() const { return static_cast<const Filter&>(*filter_); }

 private:
  Processed Refuse(Frame frame);

  Timestamp window_;
  std::unique_ptr<Estimator> filter_;  // a Filter, as are its copies
  Snapshots snapshots_;
  std::deque<ProcessedFrame> refused_;  ///< by the last call
};

namespace internal {

/// How far `timestamp` is behind `newest`, which is not before it; the longest time there is if the
/// difference overflows.
Timestamp Lag(Timestamp newest, Timestamp timestamp);

}  // namespace internal

}  // namespace alidade
