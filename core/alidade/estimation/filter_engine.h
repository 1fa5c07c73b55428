// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "alidade/base/clone_ptr.h"
#include "alidade/estimation/consensus.h"
#include "alidade/estimation/filter.h"
#include "alidade/estimation/gate.h"
#include "alidade/estimation/landmark_map.h"
#include "alidade/estimation/pending_measurements.h"
#include "alidade/estimation/recovery.h"
#include "alidade/estimation/timeline.h"
#include "alidade/estimation/update_method.h"

namespace alidade::internal {

/// Checks an option of a filter. Throws Error kBadConfig if it is not `in_range`.
void ExpectOption(bool in_range, const char* option, double value, const char* expected);

/// Engine of every recursive filter. Processes a frame by these parts, in this order:
///
///   step         StepTo            Timeline::NextSubStep, UpdateMethod::Step
///   collect                        PendingMeasurements::Collect, by measurement and sensor
///   initialise                     InitialiseWaiting, LandmarkMap::Attach
///   group        UpdateInGroups    Update of each group that `fuse` defines:
///   predict      PredictAndGate    UpdateMethod::Predict of each measurement
///   gate                           UpdateMethod::ComputeNis and Gate::Test of each;
///                                  Consensus::Split
///   correct      Correct           Gate::ApplyRobustWeights, UpdateMethod::Correct
///   recover                        Recovery::RepairCovariance; Gate::Count, Recovery::Recover
///   landmarks                      LandmarkMap::Maintain
///   inputs                         Timeline::TakeInputs: they act from the frame's timestamp on
///
/// Parts point to the problem index, which copies share, and not to each other. A copy is therefore
/// an independent filter.
class FilterEngine {
 public:
  FilterEngine(Problem problem, const EkfOptions& options, const std::vector<StreamInfo>& streams,
               std::unique_ptr<UpdateMethod> method);

  /// Implements Filter::Process. The report is in f.
  void Process(const Frame& frame);
  /// Predicts a measurement of the sensor at the current time, as Filter::Expect. `sensor` is an
  /// index into Problem::sensors.
  std::optional<Prediction> Expect(int sensor, std::int64_t landmark,
                                   const std::vector<double>& known);

  FilterState f;
  ClonePtr<UpdateMethod> method;
  std::optional<LandmarkMap> landmarks;  ///< if the problem has landmarks

 private:
  void Run(const Frame& frame);
  void StepTo(Timestamp timestamp);
  void UpdateInGroups(std::span<PendingMeasurement> rows);
  void Update(std::vector<PendingMeasurement*>& group);
  void UpdateByConsensus(std::span<PendingMeasurement* const> group);
  void PredictAndGate(std::vector<PendingMeasurement*>& group);
  bool Correct(std::span<PendingMeasurement* const> rows);
  void AddElapsedTo(FramePart part);

  /// One group of measurements, and its division into inliers and remaining ones.
  struct Groups {
    std::vector<PendingMeasurement*> group, inliers, remaining;
  };

  EkfOptions options_;
  Timeline time_;
  Gate gate_;
  Consensus consensus_;
  Recovery recovery_;
  bool stale_reported_ = false;                       ///< the last frame was stale
  std::chrono::steady_clock::time_point part_start_;  ///< of the current FramePart
  Scratch<PendingMeasurements> rows_;
  Scratch<Groups> groups_;
};

}  // namespace alidade::internal
