// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "alidade/base/timestamp.h"
#include "alidade/estimation/event.h"
#include "alidade/estimation/frame.h"
#include "alidade/estimation/landmarks.h"
#include "alidade/model/status.h"
#include "alidade/state/state.h"

namespace alidade {

class Filter;

/// Result of processing one measurement. kOutcomes documents the values.
enum class Outcome {
  kAccepted,
  kInitialised,
  kGated,
  kOutOfDomain,
  kInvalid,
  kNotFinite,
  kNotPd,
  kStale,
  kNotReady,
  kFailed,
  kEnded,
};

/// Properties of an outcome.
struct OutcomeInfo {
  Outcome outcome;
  const char* name;     ///< name in files
  const char* meaning;  ///< description in the documentation
  /// Whether the outcome counts as a rejection for rejection recovery. An outcome `not_finite`
  /// counts only if h was computed.
  bool is_rejection = false;
  bool is_gated = false;           ///< rejected by the gate or by outlier rejection
  bool is_initialisation = false;  ///< the measurement initialised a block or waits to do so
};
/// Properties of all outcomes, indexed by Outcome. To add an outcome, add a value to Outcome and an
/// entry here.
inline constexpr std::array kOutcomes = {
    OutcomeInfo{.outcome = Outcome::kAccepted,
                .name = "accepted",
                .meaning = "the update used it (also the value before the frame is processed)"},
    OutcomeInfo{.outcome = Outcome::kInitialised,
                .name = "initialised",
                .meaning = "it initialised a block and was not used for an update",
                .is_initialisation = true},
    OutcomeInfo{.outcome = Outcome::kGated,
                .name = "gated",
                .meaning = "the gate or the outlier rejection rejected it",
                .is_rejection = true,
                .is_gated = true},
    OutcomeInfo{.outcome = Outcome::kOutOfDomain,
                .name = "out_of_domain",
                .meaning = "h is not defined at the prediction",
                .is_rejection = true},
    OutcomeInfo{
        .outcome = Outcome::kInvalid,
        .name = "invalid",
        .meaning = "it is beyond the limits of the sensor, or its covariance is not a covariance"},
    OutcomeInfo{.outcome = Outcome::kNotFinite,
                .name = "not_finite",
                .meaning = "z, h, H, R, S or the update is not finite; an update was rolled back",
                .is_rejection = true},
    OutcomeInfo{
        .outcome = Outcome::kNotPd,
        .name = "not_pd",
        .meaning = "S or P would not have been positive definite; the update was rolled back",
        .is_rejection = true},
    OutcomeInfo{
        .outcome = Outcome::kStale, .name = "stale", .meaning = "it is older than the state"},
    OutcomeInfo{.outcome = Outcome::kNotReady,
                .name = "not_ready",
                .meaning = "a required block has no value yet",
                .is_initialisation = true},
    OutcomeInfo{.outcome = Outcome::kFailed, .name = "failed", .meaning = "the plugin failed"},
    OutcomeInfo{.outcome = Outcome::kEnded,
                .name = "ended",
                .meaning = "it was not processed, because the estimator had already ended"},
};
static_assert(
    [] {
      for (std::size_t i = 0; i < kOutcomes.size(); ++i) {
        if (kOutcomes[i].outcome != static_cast<Outcome>(i)) return false;
      }
      return kOutcomes.back().outcome == Outcome::kEnded;
    }(),
    "one row for each outcome, in the order of Outcome");
/// Returns the properties of an outcome.
inline const OutcomeInfo& InfoOf(Outcome outcome) {
  return kOutcomes[static_cast<std::size_t>(outcome)];
}
/// Returns the name of an outcome in files: `accepted`, `gated`.
inline const char* ToString(Outcome outcome) { return InfoOf(outcome).name; }
/// Converts the status of a model to the outcome of the measurement. kOk becomes kAccepted.
inline Outcome OutcomeOf(Status status) {
  switch (status) {
    case Status::kOk:
      return Outcome::kAccepted;
    case Status::kOutOfDomain:
      return Outcome::kOutOfDomain;
    case Status::kInvalid:
      return Outcome::kInvalid;
    case Status::kError:
      break;
  }
  return Outcome::kFailed;
}

/// Read-only view of numbers in a report. Two views are equal if all elements are equal.
struct Numbers : std::span<const double> {
  using std::span<const double>::span;  // NOLINT(modernize-use-equals-default)
  friend bool operator==(const Numbers& a, const Numbers& b) { return std::ranges::equal(a, b); }
};

/// Result of one measurement. m: tangent size of the measurement (dof). The numbers belong to the
/// estimator and are valid until its next frame. A copy of an UpdateReport stores its own numbers.
/// A view is empty if the quantity was not computed.
struct MeasurementReport {
  MeasurementReport() = default;
  MeasurementReport(int sensor_index, Outcome result, std::int64_t landmark_id, int tangent_size)
      : sensor(sensor_index), outcome(result), landmark(landmark_id), dof(tangent_size) {}

  int sensor = -1;  ///< index into Problem::sensors
  Outcome outcome = Outcome::kAccepted;
  std::int64_t landmark = -1;
  int dof = 0;
  double nis = 0.0;    ///< r' S^-1 r, not divided by dof; S without the weight w
  Numbers z, h;        ///< measurement and its prediction, ambient
  Numbers innovation;  ///< r = z (-) h, size m
  Numbers s;           ///< S = H P H' + R / w, m x m; w = 1 without a robust loss
  /// K, column by column. The rows belong to the blocks with a covariance, in the order of the
  /// layout. Empty unless the measurement was accepted.
  Numbers gain;
};

/// Reports of the measurements of a frame. Usually points to numbers in the estimator. Copy stores
/// numbers in this object, and a copy of this object stores all its numbers.
class MeasurementReports {
 public:
  MeasurementReports() = default;
  MeasurementReports(const MeasurementReports& other) { *this = other; }
  MeasurementReports(MeasurementReports&&) = default;
  MeasurementReports& operator=(const MeasurementReports& other);
  MeasurementReports& operator=(MeasurementReports&&) = default;
  ~MeasurementReports() = default;

  std::span<const MeasurementReport> entries() const { return entries_; }
  std::span<MeasurementReport> entries() { return entries_; }
  /// Appends an entry. Invalidates references to other entries.
  MeasurementReport& Add(int sensor, Outcome outcome, std::int64_t landmark, int dof) {
    return entries_.emplace_back(sensor, outcome, landmark, dof);
  }
  /// Copies the values into this object. The copy is valid until Clear.
  Numbers Copy(Numbers values);
  void Clear() {
    entries_.clear();
    numbers_.clear();
  }

 private:
  std::vector<MeasurementReport> entries_;
  std::vector<std::vector<double>> numbers_;
};

/// Parts of the processing of a frame, in their order. Filter documents them.
enum class FramePart { kStep, kEvaluate, kGate, kUpdate, kLandmarks };
inline constexpr int kFrameParts = static_cast<int>(FramePart::kLandmarks) + 1;

/// Report of one frame. The object can be reused for the next frame without allocating memory.
class UpdateReport {
 public:
  std::span<const MeasurementReport> measurements() const { return measurements_.entries(); }
  std::span<MeasurementReport> measurements() { return measurements_.entries(); }
  /// Appends an entry. Invalidates references to other entries.
  MeasurementReport& Add(int sensor = -1, Outcome outcome = Outcome::kAccepted,
                         std::int64_t landmark = -1, int dof = 0) {
    return measurements_.Add(sensor, outcome, landmark, dof);
  }
  /// Copies the values into this report. The copy is valid until Clear.
  Numbers Copy(Numbers values) { return measurements_.Copy(values); }
  void Clear() {
    stale = false;
    inputs.clear();
    landmarks = {};
    removed_landmarks.clear();
    spent_s = {};
    ClearMeasurements();
    events.clear();
  }
  void ClearMeasurements() { measurements_.Clear(); }

  bool stale = false;       ///< the frame is older than the state and was not processed
  std::vector<int> inputs;  ///< indices into Problem::motions of the control inputs that were set
  std::vector<Event> events;
  LandmarkCounts landmarks;
  /// Last estimates of the landmarks that were removed from the state at this frame. Empty for a
  /// batch.
  std::vector<LandmarkEstimate> removed_landmarks;
  /// Wall-clock time of each FramePart. Measured only by filters with landmarks.
  std::array<double, kFrameParts> spent_s{};

 private:
  MeasurementReports measurements_;
};

/// Estimator for one problem. An estimator does not read files, print or end the program.
class Estimator {
 public:
  /// Function that receives the estimate and the report of frame `index`. The frame of the first
  /// call of Process has index 0.
  using Emit = std::function<void(std::size_t index, const State&, const UpdateReport&)>;

  virtual ~Estimator() = default;
  /// Sets the time of the initial state.
  virtual void Start(Timestamp timestamp) = 0;
  /// Propagates the state to the timestamp of the frame, and uses the measurements of all streams
  /// that have a sensor. The report is valid until the next call.
  virtual const UpdateReport& Process(const Frame& frame) = 0;
  /// Returns whether the estimates depend on later frames too (a smoother, a batch). If so, state()
  /// is not meaningful after Process, and Smooth computes the estimates.
  virtual bool offline() const { return false; }
  /// Computes the estimates of all frames and passes them to `emit` in the order of the frames.
  /// Called once, after the last frame. The events of the smoothing itself are in the last report.
  /// If an estimate cannot be computed, throws an Error with the reason, and failed() is true.
  /// Exceptions of `emit` propagate.
  virtual void Smooth(const Emit& /*emit*/) {}
  /// Sets a function that Smooth calls repeatedly while it runs. If the function returns true,
  /// Smooth throws an Error kStopped. If the function is null, Smooth is never stopped.
  virtual void StopWhen(const std::function<bool()>& /*stop*/) {}
  /// Returns a copy whose later results equal those of this estimator bit by bit, or null if the
  /// estimator cannot be copied.
  virtual std::unique_ptr<Estimator> Clone() const { return nullptr; }
  /// Returns this estimator as a recursive filter, or null if it is not a recursive filter.
  virtual const Filter* AsFilter() const { return nullptr; }
  virtual const State& state() const = 0;
  /// Returns the landmarks in the state, ordered by id.
  virtual std::vector<LandmarkEstimate> landmarks() const { return {}; }
  virtual Timestamp timestamp() const = 0;
  /// Returns whether the filter diverged: its estimate left the domain of a sensor, or its numbers
  /// became invalid. An event reports the reason.
  virtual bool diverged() const = 0;
  /// Returns whether the estimator ended early because it cannot continue.
  virtual bool failed() const = 0;
};

}  // namespace alidade
