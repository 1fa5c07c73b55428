// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "alidade/base/indirect.h"
#include "alidade/estimation/consensus.h"
#include "alidade/estimation/filter.h"
#include "alidade/estimation/gate.h"
#include "alidade/estimation/landmark_map.h"
#include "alidade/estimation/method.h"
#include "alidade/estimation/recovery.h"
#include "alidade/estimation/rows.h"
#include "alidade/estimation/timeline.h"

namespace alidade::internal {

/// Refuses an option of a filter that is out of its range. Error kBadConfig, if not `holds`.
void ExpectOption(bool holds, const char* option, double value, const char* expected);

/// What a filter is made of, and what a frame goes through there:
///
///   step         StepTo             Timeline::First, Method::Step
///   collect                         Rows::Collect: one row for each measurement and sensor
///   initialise                      InitialiseWaiting, LandmarkMap::Attach
///   group        UpdateInGroups     Update of each group by itself, as `fuse` has them:
///   predict      PredictAndGate     Method::Predict of each row
///   gate                            Method::ComputeNis, Gate::Test of each row; Consensus::Split
///   correct      Correct            Gate::ApplyRobustWeights, Method::Correct
///   recover                         Recovery::RepairCovariance; Gate::Count, Recovery::Recover
///   landmarks                       LandmarkMap::Maintain
///   inputs                          Timeline::TakeInputs: they act from here on
///
/// Parts point to the binding, which copies share, and not into one another. So a copy is a filter
/// by itself.
class FrameLoop {
 public:
  FrameLoop(System system, const EkfOptions& options, const std::vector<StreamInfo>& streams,
            std::unique_ptr<Method> method);

  /// All that Filter::Process does. The report is in f.
  void Process(const Frame& frame);
  /// What the sensor, an index into System::sensors, would measure now; as Filter::Expect.
  std::optional<Prediction> Expect(int sensor, std::int64_t landmark,
                                   const std::vector<double>& known);

  FilterState f;
  Indirect<Method> method;
  std::optional<LandmarkMap> landmarks;  ///< where the system has any

 private:
  void Run(const Frame& frame);
  void StepTo(Timestamp timestamp);
  void UpdateInGroups(std::span<Row> rows);
  void Update(std::vector<Row*>& group);
  void UpdateByConsensus(std::span<Row* const> group);
  void PredictAndGate(std::vector<Row*>& group);
  bool Correct(std::span<Row* const> rows);
  void Spent(FramePart part);

  /// One group of rows, and what becomes of it.
  struct Groups {
    std::vector<Row*> group, agreed, rest;
  };

  EkfOptions options_;
  Timeline time_;
  Gate gate_;
  Consensus consensus_;
  Recovery recovery_;
  bool stale_noted_ = false;                     ///< the last frame was stale
  std::chrono::steady_clock::time_point since_;  ///< the part of the frame at hand goes on
  Scratch<Rows> rows_;
  Scratch<Groups> groups_;
};

}  // namespace alidade::internal
