// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "alidade/base/timestamp.h"
#include "alidade/model/status.h"
#include "alidade/system/landmarks.h"

namespace alidade {

/// What became of one measurement.
enum class Outcome {
  kAccepted,     ///< also while the frame goes on, as long as nothing speaks against it
  kInitialised,  ///< consumed to initialise a block
  kGated,
  kOutOfDomain,  ///< h is not defined at the prediction
  kInvalid,      ///< of no use: beyond the sensor's limits, or its covariance is none
  kNotFinite,    ///< it is itself, its h, H, R or S, or the update, which was rolled back
  kNotPd,        ///< the update would have lost positive definiteness, and was rolled back
  kStale,        ///< older than the state
  kNotReady,     ///< a block it needs has no value yet
  kFailed,       ///< the plugin failed
  kEnded,        ///< not looked at: the estimator has nothing left to go on with
};
inline constexpr int kOutcomes = static_cast<int>(Outcome::kEnded) + 1;
const char* ToString(Outcome outcome);
/// What a model's status means for the measurement; kOk is kAccepted.
Outcome OutcomeOf(Status status);

/// All that is known of one measurement; m = dof, its tangent size. Empty: not reached.
struct MeasurementReport {
  int sensor = -1;  ///< index into System::sensors
  Outcome outcome = Outcome::kAccepted;
  std::int64_t landmark = -1;
  int dof = 0;
  double nis = 0.0;                ///< r' S^-1 r, not divided by dof; S without the loss
  std::vector<double> z, h;        ///< ambient
  std::vector<double> innovation;  ///< r = z (-) h, m
  std::vector<double> s;           ///< S = H P H' + R / w, m x m; w < 1 by a robust loss alone
  /// K by columns, its rows those of the blocks with a covariance in the order of the layout; empty
  /// unless accepted.
  std::vector<double> gain;

  /// Makes it that of a new measurement, nothing reached yet. The memory is kept.
  void Reset(int of_sensor, std::int64_t of_landmark, int of_dof) {
    sensor = of_sensor;
    landmark = of_landmark;
    dof = of_dof;
    outcome = Outcome::kAccepted;
    nis = 0.0;
    for (std::vector<double>* part : {&z, &h, &innovation, &s, &gain}) part->clear();
  }
};

/// Something that happened to the filter, worth a line to its user.
struct Event {
  Timestamp timestamp = kNoTimestamp;
  std::string kind;  ///< one word: diverged, rejection_recovery, conditioning, not_finite, ...
  std::string text;
  bool divergence = false;  ///< the estimator diverged or failed by this
};

/// What one frame did. Filled again and again without allocating.
class UpdateReport {
 public:
  std::span<const MeasurementReport> measurements() const { return {pool_.data(), count_}; }
  std::span<MeasurementReport> measurements() { return {pool_.data(), count_}; }
  /// One more; references to the others end.
  MeasurementReport& Add() {
    const auto next = pool_.begin() + static_cast<std::ptrdiff_t>(count_++);
    return next == pool_.end() ? pool_.emplace_back() : *next;
  }
  void Clear() {
    stale = false;
    inputs.clear();
    landmarks = {};
    ClearMeasurements();
    events.clear();
  }
  void ClearMeasurements() { count_ = 0; }

  bool stale = false;       ///< the frame is older than the state, which stays as it was
  std::vector<int> inputs;  ///< motion models whose control input was taken, as in System::motions
  std::vector<Event> events;
  LandmarkCounts landmarks;

 private:
  std::vector<MeasurementReport> pool_;  ///< the first count_ are in use
  std::size_t count_ = 0;
};

}  // namespace alidade
