// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace alidade {

struct Experiment;   // in alidade/run/experiment.h
struct SourceFrame;  // in alidade/host/source.h
class UpdateReport;  // in alidade/filter/estimator.h
class State;         // in alidade/state/state.h

/// Follows a run on its own thread. What it throws ends the run, and is its reason.
class RunObserver {
 public:
  virtual ~RunObserver() = default;
  /// Once, before the first frame.
  virtual void Begin(const Experiment& /*experiment*/) {}
  /// Each frame before the estimators take it; the truth they are not given.
  virtual void OnFrame(const SourceFrame& /*frame*/) {}
  /// Each estimate as it is made, with the index of its estimator; those of an offline estimator
  /// after the last frame.
  virtual void OnEstimate(int /*estimator*/, const SourceFrame& /*frame*/, const State& /*state*/,
                          const UpdateReport& /*report*/) {}
};

}  // namespace alidade
