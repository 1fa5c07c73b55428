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

/// Refuses an option of a filter that is out of its range. Error kBadConfig, if not `holds`.
void ExpectOption(bool holds, const char* option, double value, const char* expected);

/// The engine of every recursive filter: its parts, and the way of a frame through them:
///
///   step         StepTo            Timeline::NextSubStep, UpdateMethod::Step
///   collect                        PendingMeasurements::Collect, by measurement and sensor
///   initialise                     InitialiseWaiting, LandmarkMap::Attach
///   group        UpdateInGroups    Update of each group by itself, as `fuse` has them:
///   predict      PredictAndGate    UpdateMethod::Predict of each measurement
///   gate                           UpdateMethod::ComputeNis and Gate::Test of each;
///                                  Consensus::Split
///   correct      Correct           Gate::ApplyRobustWeights, UpdateMethod::Correct
///   recover                        Recovery::RepairCovariance; Gate::Count, Recovery::Recover
///   landmarks                      LandmarkMap::Maintain
///   inputs                         Timeline::TakeInputs: they act from here on
///
/// Parts point to the problem index, which copies share, and not into one another. So a copy is a
/// filter by itself.
class FilterEngine {
 public:
  FilterEngine(Problem problem, const EkfOptions& options, const std::vector<StreamInfo>& streams,
               std::unique_ptr<UpdateMethod> method);

  /// All that Filter::Process does. The report is in f.
  void Process(const Frame& frame);
  /// What the sensor, an index into Problem::sensors, would measure now; as Filter::Expect.
  std::optional<Prediction> Expect(int sensor, std::int64_t landmark,
                                   const std::vector<double>& known);

  FilterState f;
  ClonePtr<UpdateMethod> method;
  std::optional<LandmarkMap> landmarks;  ///< where the problem has any

 private:
  void Run(const Frame& frame);
  void StepTo(Timestamp timestamp);
  void UpdateInGroups(std::span<PendingMeasurement> rows);
  void Update(std::vector<PendingMeasurement*>& group);
  void UpdateByConsensus(std::span<PendingMeasurement* const> group);
  void PredictAndGate(std::vector<PendingMeasurement*>& group);
  bool Correct(std::span<PendingMeasurement* const> rows);
  void Spent(FramePart part);

  /// One group of rows, and what becomes of it.
  struct Groups {
    std::vector<PendingMeasurement*> group, agreed, rest;
  };

  EkfOptions options_;
  Timeline time_;
  Gate gate_;
  Consensus consensus_;
  Recovery recovery_;
  bool stale_noted_ = false;                     ///< the last frame was stale
  std::chrono::steady_clock::time_point since_;  ///< the part of the frame at hand goes on
  Scratch<PendingMeasurements> rows_;
  Scratch<Groups> groups_;
};

}  // namespace alidade::internal
