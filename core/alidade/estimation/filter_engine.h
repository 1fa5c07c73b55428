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

/// If `in_range` is false, throws Error kBadConfig with the option, its value and `expected`.
void ExpectOption(bool in_range, const char* option, double value, const char* expected);

/// Implementation of every recursive filter. Processes a frame in these stages, with these
/// functions:
///
///   step         StepTo            Timeline::NextSubStep, UpdateMethod::Step
///   collect                        PendingMeasurements::Collect of all measurements and sensors
///   initialise                     InitialiseWaiting, LandmarkMap::Attach
///   group        UpdateInGroups    Update of each group that `fuse` defines, in three stages:
///   predict      PredictAndGate    UpdateMethod::Predict of each measurement
///   gate                           UpdateMethod::ComputeNis and Gate::Test of each measurement;
///                                  Consensus::Split
///   correct      Correct           Gate::ApplyRobustWeights, UpdateMethod::Correct
///   recover                        Recovery::RepairCovariance, Recovery::Count
///   landmarks                      LandmarkMap::Maintain
///   inputs                         Timeline::TakeInputs, which act from the frame's timestamp on
///
/// The members do not point to each other. They point only to the problem index, which all copies
/// share. A copy is therefore an independent filter.
class FilterEngine {
 public:
  FilterEngine(Problem problem, const EkfOptions& options, const std::vector<StreamInfo>& streams,
               std::unique_ptr<UpdateMethod> method);

  /// Implements Filter::Process. The report is `f.report`.
  void Process(const Frame& frame);
  /// Implements Filter::Expect at the current time. `sensor` is an index into Problem::sensors.
  std::optional<Prediction> Expect(int sensor, std::int64_t landmark,
                                   const std::vector<double>& known);

  FilterState f;
  ClonePtr<UpdateMethod> method;
  std::optional<LandmarkMap> landmarks;  ///< nullopt if the problem has no landmarks

 private:
  void Run(const Frame& frame);
  void StepTo(Timestamp timestamp);
  void UpdateInGroups(std::span<PendingMeasurement> rows);
  void Update(std::vector<PendingMeasurement*>& group);
  void UpdateByConsensus(std::span<PendingMeasurement* const> group);
  void PredictAndGate(std::vector<PendingMeasurement*>& group);
  bool Correct(std::span<PendingMeasurement* const> rows);
  void AddElapsedTo(FramePart part);

  /// A group of measurements, and its division into inliers and remaining measurements.
  struct Groups {
    std::vector<PendingMeasurement*> group, inliers, remaining;
  };

  EkfOptions options_;
  Timeline time_;
  Gate gate_;
  Consensus consensus_;
  Recovery recovery_;
  bool stale_reported_ = false;                       ///< whether the previous frame was stale
  std::chrono::steady_clock::time_point part_start_;  ///< start of the current FramePart
  Scratch<PendingMeasurements> rows_;
  Scratch<Groups> groups_;
};

}  // namespace alidade::internal
