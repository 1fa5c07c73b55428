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

/// Result of processing one measurement. The meanings are in kOutcomes.
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
  const char* name;     ///< in files
  const char* meaning;  ///< a sentence for the documentation
  /// Whether it counts towards rejection recovery; `not_finite` only if h was computed.
  bool is_rejection = false;
  bool is_gated = false;           ///< by the gate or by outlier rejection
  bool is_initialisation = false;  ///< the measurement initialises a block, or could do so
};
/// Properties of all outcomes, indexed by Outcome. A new outcome is a value of Outcome and a row.
inline constexpr std::array kOutcomes = {
    OutcomeInfo{.name = "accepted",
                .meaning = "the update used it; also the initial value during a frame"},
    OutcomeInfo{.name = "initialised",
                .meaning = "it was consumed to initialise a block",
                .is_initialisation = true},
    OutcomeInfo{.name = "gated",
                .meaning = "the gate or the outlier rejection rejected it",
                .is_rejection = true,
                .is_gated = true},
    OutcomeInfo{.name = "out_of_domain",
                .meaning = "h is not defined at the prediction",
                .is_rejection = true},
    OutcomeInfo{
        .name = "invalid",
        .meaning = "it is beyond the limits of the sensor, or its covariance is not a covariance"},
    OutcomeInfo{.name = "not_finite",
                .meaning = "z, h, H, R, S or the update is not finite; an update was rolled back",
                .is_rejection = true},
    OutcomeInfo{.name = "not_pd",
                .meaning = "the update would have lost positive definiteness, and was rolled back",
                .is_rejection = true},
    OutcomeInfo{.name = "stale", .meaning = "it is older than the state"},
    OutcomeInfo{.name = "not_ready",
                .meaning = "a required block has no value yet",
                .is_initialisation = true},
    OutcomeInfo{.name = "failed", .meaning = "the plugin failed"},
    OutcomeInfo{.name = "ended",
                .meaning = "it was not processed: the estimator had failed before"},
};
static_assert(kOutcomes.size() == static_cast<std::size_t>(Outcome::kEnded) + 1);
/// Returns the properties of an outcome.
inline const OutcomeInfo& InfoOf(Outcome outcome) {
  return kOutcomes[static_cast<std::size_t>(outcome)];
}
/// Returns the name of an outcome in files: `accepted`, `gated`.
inline const char* ToString(Outcome outcome) { return InfoOf(outcome).name; }
/// Converts the status of a model to the outcome of the measurement; kOk to kAccepted.
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

/// Read-only view of the numbers of a report. Equal if all elements are equal.
struct Numbers : std::span<const double> {
  using std::span<const double>::span;  // NOLINT(modernize-use-equals-default)
  friend bool operator==(const Numbers& a, const Numbers& b) { return std::ranges::equal(a, b); }
};

/// Result of one measurement; m = dof, its tangent size. The numbers are stored in the estimator
/// and valid until its next frame; the numbers of a copy are stored in its UpdateReport. A view is
/// empty if its quantity was not computed.
struct MeasurementReport {
  MeasurementReport() = default;
  MeasurementReport(int sensor_index, Outcome result, std::int64_t landmark_id, int tangent_size)
      : sensor(sensor_index), outcome(result), landmark(landmark_id), dof(tangent_size) {}

  int sensor = -1;  ///< index into Problem::sensors
  Outcome outcome = Outcome::kAccepted;
  std::int64_t landmark = -1;
  int dof = 0;
  double nis = 0.0;    ///< r' S^-1 r, not divided by dof; S without the weight w
  Numbers z, h;        ///< ambient
  Numbers innovation;  ///< r = z (-) h, m
  Numbers s;           ///< S = H P H' + R / w, m x m; w = 1 without a robust loss
  /// K, column by column. Its rows belong to the blocks with a covariance, in the order of the
  /// layout. Empty unless accepted.
  Numbers gain;
};

/// Reports of the measurements of a frame, and memory for numbers that no other object stores. A
/// copy stores all numbers itself.
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

/// Parts of the processing of a frame, in their order; see Filter.
enum class FramePart { kStep, kEvaluate, kGate, kUpdate, kLandmarks };
inline constexpr int kFrameParts = static_cast<int>(FramePart::kLandmarks) + 1;

/// Report of one frame. Can be reused without allocating memory.
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

  bool stale = false;       ///< the frame is older than the state, which is unchanged
  std::vector<int> inputs;  ///< indices into Problem::motions of the control inputs that were set
  std::vector<Event> events;
  LandmarkCounts landmarks;
  /// Last estimates of the landmarks that the frame removed from the state. Empty for a batch.
  std::vector<LandmarkEstimate> removed_landmarks;
  /// Wall-clock time by FramePart. Only filters with landmarks measure it.
  std::array<double, kFrameParts> spent_s{};

 private:
  MeasurementReports measurements_;
};

/// Estimator for one problem. It does not read files, print or exit.
class Estimator {
 public:
  /// Receives the estimate and the report of frame `index`, counted from the first call of Process.
  using Emit = std::function<void(std::size_t index, const State&, const UpdateReport&)>;

  virtual ~Estimator() = default;
  /// Sets the time of the initial state.
  virtual void Start(Timestamp timestamp) = 0;
  /// Steps to the timestamp of the frame and uses the measurements whose stream has a sensor. The
  /// report is valid until the next call.
  virtual const UpdateReport& Process(const Frame& frame) = 0;
  /// Returns whether the estimates depend on later frames too (a smoother, a batch). If so, state()
  /// is not meaningful after Process, and Smooth computes the estimates.
  virtual bool offline() const { return false; }
  /// Computes the estimates of all frames and passes them to `emit` in order. Called once, after
  /// the last frame. The last report has the events of the smoothing itself. If estimates are
  /// missing, throws an Error with the reason, and failed() is true. Exceptions of `emit`
  /// propagate.
  virtual void Smooth(const Emit& /*emit*/) {}
  /// Sets a function that Smooth calls repeatedly while it runs. If it returns true, Smooth throws
  /// an Error kStopped. A null function never stops.
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
  /// Returns whether the estimate left the domain of a sensor or the numbers became invalid; see
  /// the events.
  virtual bool diverged() const = 0;
  /// Returns whether the estimator cannot continue (not finite, unrecoverable).
  virtual bool failed() const = 0;
};

}  // namespace alidade
