// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "alidade/filter/update_report.h"
#include "alidade/host/source.h"
#include "alidade/state/state.h"
#include "alidade/system/landmarks.h"

namespace alidade {

/// An estimator over one system. It takes values and returns values: it neither reads files nor
/// prints nor exits.
class Estimator {
 public:
  /// Takes the estimate of frame `index`, counted from the first call of Process, and its report.
  using Emit = std::function<void(std::size_t index, const State&, const UpdateReport&)>;

  virtual ~Estimator() = default;
  /// Sets the time of the initial state.
  virtual void Start(Timestamp timestamp) = 0;
  /// Steps to the frame's timestamp and uses those of its measurements that a sensor is bound to.
  /// The report is good until the next call.
  virtual const UpdateReport& Process(const Frame& frame) = 0;
  /// True where an estimate depends on later frames too (a smoother, a batch): state() after
  /// Process is then of no use to anyone but the estimator, and Smooth gives the estimates.
  virtual bool offline() const { return false; }
  /// Once, after the last frame: the estimates of all frames, in their order. The events of the
  /// smoothing itself come with the last report. Errors: where there is nothing to emit, or not
  /// all, failed() turns true and the text of the error says why; whatever `emit` throws.
  virtual void Smooth(const Emit& /*emit*/) {}
  /// Where Smooth takes long, it asks `stop` now and then; where that is true it ends by an Error
  /// of kStopped. A null function never stops.
  virtual void StopWhen(const std::function<bool()>& /*stop*/) {}
  /// A copy, whose every result from here on has the bits that this one's would have; null: it
  /// cannot be copied.
  virtual std::unique_ptr<Estimator> Clone() const { return nullptr; }
  virtual const State& state() const = 0;
  /// The landmarks in the state, by id.
  virtual std::vector<LandmarkEstimate> landmarks() const { return {}; }
  virtual Timestamp timestamp() const = 0;
  /// True once the filter left the domain of its sensors or lost its numbers; see the events.
  virtual bool diverged() const = 0;
  /// True where there is nothing left to go on with (not finite, unrecoverable).
  virtual bool failed() const = 0;
};

}  // namespace alidade
