// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <exception>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "alidade/estimation/rollback.h"
#include "alidade/experiment/estimator_guide.h"
#include "alidade/experiment/run.h"

namespace alidade::internal {

/// The frames of an experiment's source in the order of its OutOfSequencePolicy. Under kRollback it
/// also steers the estimators: they take each frame as it comes, and what came after an
/// out-of-sequence one again. The source is guided, where it asks for it.
class FrameOrder {
 public:
  using Check = std::function<void(SourceFrame&)>;

  /// `check` takes each frame first; it throws for one that the estimators must not see.
  FrameOrder(Experiment& experiment, Check check);
  /// Takes back what the estimators were given beyond the frame that Next gave last.
  ~FrameOrder();
  FrameOrder(const FrameOrder&) = delete;
  FrameOrder& operator=(const FrameOrder&) = delete;

  /// The next frame that no other can come before; false at the end. An error of the source, of
  /// `check` or of an estimator is thrown once the frames held back are out. Errors: kBadData where
  /// a stream, or another value of a truth, comes twice at one timestamp.
  bool Next(SourceFrame& frame);
  /// The frame that Next gave as the estimator processed it when it came, under kRollback; else
  /// null. Good until the next call of Next.
  const ProcessedFrame* processed(std::size_t estimator) const;
  const Arrivals& arrivals() const { return arrivals_; }
  /// `out_of_sequence` of each frame dropped since the last call.
  std::vector<Event> TakeEvents() { return std::exchange(events_, {}); }

 private:
  struct Held {
    SourceFrame frame;
    std::vector<Place> places;  ///< of the measurements
  };

  bool Accept(const Frame& frame);
  void Receive();
  std::size_t Insert(Held&& received);
  void CheckMerge(const Held& held, const SourceFrame& part) const;
  void Merge(Held& held, Held&& received) const;
  void Replay(std::size_t from);
  Frame Accepted(std::size_t index, int by) const;
  bool IsTooLate(Timestamp timestamp) const;
  std::string Names(const Frame& frame) const;

  Experiment& experiment_;
  Check check_;
  EstimatorGuide guide_;
  std::deque<Held> held_;  ///< by timestamp
  /// By estimator, of the frames held; none if it is offline. Empty but under kRollback.
  std::vector<std::optional<Snapshots>> snapshots_;
  Timestamp newest_ = kNoTimestamp;
  bool ended_ = false;
  std::exception_ptr failure_;
  Arrivals arrivals_;
  std::vector<Event> events_;
};

}  // namespace alidade::internal
