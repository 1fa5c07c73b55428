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

#include "alidade/base/enum_table.h"
#include "alidade/base/timestamp.h"
#include "alidade/estimation/event.h"
#include "alidade/estimation/frame.h"
#include "alidade/estimation/landmarks.h"
#include "alidade/model/status.h"
#include "alidade/state/state.h"

namespace alidade {

class Filter;

/// Result of processing one measurement. kOutcomes documents the values. A measurement that was not
/// yet processed has the value kAccepted.
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
  const char* name;      ///< name in files
  const char* meaning;   ///< description in the documentation
  bool is_used = false;  ///< the measurement initialised or corrected a block
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
                .meaning = "an update used the measurement",
                .is_used = true},
    OutcomeInfo{.outcome = Outcome::kInitialised,
                .name = "initialised",
                .meaning = "the measurement initialised a block; no update used it",
                .is_used = true,
                .is_initialisation = true},
    OutcomeInfo{.outcome = Outcome::kGated,
                .name = "gated",
                .meaning = "the gate or the outlier rejection rejected the measurement",
                .is_rejection = true,
                .is_gated = true},
    OutcomeInfo{.outcome = Outcome::kOutOfDomain,
                .name = "out_of_domain",
                .meaning = "h is not defined at the prediction",
                .is_rejection = true},
    OutcomeInfo{.outcome = Outcome::kInvalid,
                .name = "invalid",
                .meaning = "the measurement is beyond the limits of the sensor, or its covariance "
                           "matrix is invalid"},
    OutcomeInfo{.outcome = Outcome::kNotFinite,
                .name = "not_finite",
                .meaning = "z, h, H, R, S or the result of the update is not finite; the state is "
                           "unchanged",
                .is_rejection = true},
    OutcomeInfo{
        .outcome = Outcome::kNotPd,
        .name = "not_pd",
        .meaning = "S or P would not have been positive definite; the update was rolled back",
        .is_rejection = true},
    OutcomeInfo{.outcome = Outcome::kStale,
                .name = "stale",
                .meaning = "the measurement is older than the state"},
    OutcomeInfo{.outcome = Outcome::kNotReady,
                .name = "not_ready",
                .meaning = "a required block has no value yet",
                .is_initialisation = true},
    OutcomeInfo{.outcome = Outcome::kFailed,
                .name = "failed",
                .meaning = "the sensor model reported an error"},
    OutcomeInfo{.outcome = Outcome::kEnded,
                .name = "ended",
                .meaning = "the measurement was not processed, because the estimator had already "
                           "ended"},
};
static_assert(internal::HasEntryForEach(kOutcomes, &OutcomeInfo::outcome, Outcome::kEnded),
              "kOutcomes must have one entry for each Outcome, in the order of Outcome");
/// Returns the properties of an outcome.
inline const OutcomeInfo& InfoOf(Outcome outcome) {
  return kOutcomes[static_cast<std::size_t>(outcome)];
}
/// Returns the name that files use for an outcome, such as `accepted`.
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

/// Result of one measurement. m: tangent size of the measurement (dof). The estimator owns the
/// numbers, which are valid until it processes the next frame. A copy of an UpdateReport owns its
/// numbers. A view is empty if the quantity was not computed.
struct MeasurementReport {
  MeasurementReport() = default;
  MeasurementReport(int sensor_index, Outcome result, std::int64_t landmark_id, int tangent_size)
      : sensor(sensor_index), outcome(result), landmark(landmark_id), dof(tangent_size) {}

  int sensor = -1;  ///< index into Problem::sensors
  Outcome outcome = Outcome::kAccepted;
  std::int64_t landmark = -1;
  int dof = 0;
  double nis = 0.0;    ///< r' S^-1 r, not divided by dof; here S is computed with w = 1
  Numbers z, h;        ///< measurement and its prediction, ambient
  Numbers innovation;  ///< r = z (-) h, size m
  Numbers s;           ///< S = H P H' + R / w, m x m; w = 1 without a robust loss
  /// K, column by column. The rows belong to the blocks with a covariance, in the order of the
  /// layout. Empty unless the measurement was accepted.
  Numbers gain;
};

/// Reports of the measurements of a frame. The entries usually point to numbers that the estimator
/// owns. The function Copy stores numbers in this object. A copy of this object stores the numbers
/// of all entries.
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

/// Parts of the processing of a frame, in the order of execution. The comment on Filter describes
/// the processing.
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

  bool stale = false;  ///< the frame is older than the state and was not processed
  /// Motion models whose control input this frame set, as indices into Problem::motions.
  std::vector<int> inputs;
  std::vector<Event> events;
  LandmarkCounts landmarks;
  /// Last estimates of the landmarks that were removed from the state at this frame. Empty for a
  /// batch.
  std::vector<LandmarkEstimate> removed_landmarks;
  /// Wall-clock time of each FramePart, in s. Only filters with landmarks measure the times.
  std::array<double, kFrameParts> spent_s{};

 private:
  MeasurementReports measurements_;
};

/// Estimator for one problem. An estimator does not read files, print text or end the program.
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
  /// Returns whether the estimates also depend on later frames, as those of a smoother or a batch.
  /// If so, state() is not meaningful after Process, and Smooth computes the estimates.
  virtual bool offline() const { return false; }
  /// Computes the estimates of all frames and passes them to `emit` in the order of the frames.
  /// Must be called once, after the last frame. The report of the last frame contains the events of
  /// the smoothing. If an estimate cannot be computed, throws an Error with the reason; failed() is
  /// then true. Exceptions of `emit` propagate.
  virtual void Smooth(const Emit& /*emit*/) {}
  /// Sets a function that Smooth calls repeatedly. If the function returns true, Smooth throws an
  /// Error kStopped. If the function is null, Smooth is never stopped.
  virtual void StopWhen(const std::function<bool()>& /*stop*/) {}
  /// Returns a copy that computes bit-identical results from the same later frames, or null if the
  /// estimator cannot be copied.
  virtual std::unique_ptr<Estimator> Clone() const { return nullptr; }
  /// Returns this estimator as a recursive filter, or null if it is not a recursive filter.
  virtual const Filter* AsFilter() const { return nullptr; }
  virtual const State& state() const = 0;
  /// Returns the landmarks in the state, ordered by id.
  virtual std::vector<LandmarkEstimate> landmarks() const { return {}; }
  virtual Timestamp timestamp() const = 0;
  /// Returns whether the estimator diverged: the estimate left the domain of a model, or a step or
  /// update failed so that the estimator ended. An event reports the reason.
  virtual bool diverged() const = 0;
  /// Returns whether the estimator ended before the last frame because of an error.
  virtual bool failed() const = 0;
};

}  // namespace alidade
