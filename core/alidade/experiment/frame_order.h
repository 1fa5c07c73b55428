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

/// Frame order: returns the frames of a source in the order that the experiment's
/// OutOfSequencePolicy requires. Under kRollback, this class also runs the estimators. The
/// estimators process each frame on arrival. After an out-of-sequence frame, they process the later
/// frames again. If the config requests a guide, this class also guides the source.
class FrameOrder {
 public:
  using Check = std::function<void(SourceFrame&)>;

  /// Calls `check` for each frame before the frame is used. `check` throws if the estimators must
  /// not process the frame.
  FrameOrder(Experiment& experiment, Check check);
  /// Restores each estimator to its state after the last frame that Next() returned.
  ~FrameOrder();
  FrameOrder(const FrameOrder&) = delete;
  FrameOrder& operator=(const FrameOrder&) = delete;

  /// Writes the next frame to `frame`. Unless the policy is kReject, no frame that arrives later
  /// can precede this frame. Returns false if there are no more frames. If the source, `check` or
  /// an estimator throws an exception, returns all buffered frames first, and then throws this
  /// exception. Error: kBadData if one timestamp has two measurements of a stream, or two values of
  /// a truth.
  bool Next(SourceFrame& frame);
  /// Under kRollback, returns the result of the estimator for the frame that Next() last returned.
  /// The estimator processed this frame on arrival. Returns null under other policies, and for an
  /// offline estimator. The result is valid until the next call of Next().
  const ProcessedFrame* processed(std::size_t estimator) const;
  const Arrivals& arrivals() const { return arrivals_; }
  /// Returns an event `out_of_sequence` for each frame that was dropped since the last call.
  std::vector<Event> ExtractEvents() { return std::exchange(events_, {}); }

 private:
  struct BufferedFrame {
    SourceFrame frame;
    std::vector<Place> places;  ///< place of each measurement in its file
  };

  bool Accept(const Frame& frame);
  void Receive();
  std::size_t Insert(BufferedFrame&& received);
  void CheckMerge(const BufferedFrame& buffered, const SourceFrame& part) const;
  void Merge(BufferedFrame& buffered, BufferedFrame&& received) const;
  void Replay(std::size_t first);
  Frame AcceptedFrame(std::size_t index, int estimator) const;
  bool IsTooLate(Timestamp timestamp) const;
  std::string StreamNames(const Frame& frame) const;

  Experiment& experiment_;
  Check check_;
  EstimatorGuide guide_;
  std::deque<BufferedFrame> buffer_;  ///< buffered frames in the order of their timestamps
  /// Snapshots of each estimator for the buffered frames; nullopt for an offline estimator. The
  /// list is empty unless the policy is kRollback.
  std::vector<std::optional<Snapshots>> snapshots_;
  Timestamp newest_ = kNoTimestamp;
  bool is_at_end_ = false;
  std::exception_ptr failure_;
  Arrivals arrivals_;
  std::vector<Event> events_;
};

}  // namespace alidade::internal
