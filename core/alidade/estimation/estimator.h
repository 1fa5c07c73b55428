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
#include "alidade/estimation/frame.h"
#include "alidade/estimation/landmarks.h"
#include "alidade/model/status.h"
#include "alidade/state/state.h"

namespace alidade {

class Filter;

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

/// How an outcome counts.
struct OutcomeInfo {
  const char* name;  ///< in files
  /// Whether it counts towards rejection recovery; `not_finite` only if h was computed.
  bool is_rejection = false;
  bool is_gated = false;  ///< by the gate or by outlier rejection
  bool starts = false;    ///< of what has no value before it
};
/// The outcomes that there are, by Outcome. Another one is a row here.
inline constexpr std::array kOutcomes = {
    OutcomeInfo{"accepted"},
    OutcomeInfo{.name = "initialised", .starts = true},
    OutcomeInfo{.name = "gated", .is_rejection = true, .is_gated = true},
    OutcomeInfo{.name = "out_of_domain", .is_rejection = true},
    OutcomeInfo{"invalid"},
    OutcomeInfo{.name = "not_finite", .is_rejection = true},
    OutcomeInfo{.name = "not_pd", .is_rejection = true},
    OutcomeInfo{"stale"},
    OutcomeInfo{.name = "not_ready", .starts = true},
    OutcomeInfo{"failed"},
    OutcomeInfo{"ended"},
};
static_assert(kOutcomes.size() == static_cast<std::size_t>(Outcome::kEnded) + 1);
/// The row of an outcome.
inline const OutcomeInfo& InfoOf(Outcome outcome) {
  return kOutcomes[static_cast<std::size_t>(outcome)];
}
/// Its name, as in files: `accepted`, `gated`.
inline const char* ToString(Outcome outcome) { return InfoOf(outcome).name; }
/// What a model's status means for the measurement; kOk is kAccepted.
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

/// Numbers of a report.
struct Numbers : std::span<const double> {
  using std::span<const double>::span;  // NOLINT(modernize-use-equals-default)
  friend bool operator==(const Numbers& a, const Numbers& b) { return std::ranges::equal(a, b); }
};

/// All that is known of one measurement; m = dof, its tangent size. The numbers lie in the memory
/// of the estimator until its next frame, those of a copy in that of its UpdateReport. Empty: not
/// reached.
struct MeasurementReport {
  MeasurementReport() = default;
  MeasurementReport(int of_sensor, Outcome became, std::int64_t of_landmark, int tangent_size)
      : sensor(of_sensor), outcome(became), landmark(of_landmark), dof(tangent_size) {}

  int sensor = -1;  ///< index into Problem::sensors
  Outcome outcome = Outcome::kAccepted;
  std::int64_t landmark = -1;
  int dof = 0;
  double nis = 0.0;    ///< r' S^-1 r, not divided by dof; S without the loss
  Numbers z, h;        ///< ambient
  Numbers innovation;  ///< r = z (-) h, m
  Numbers s;           ///< S = H P H' + R / w, m x m; w < 1 by a robust loss alone
  /// K by columns, its rows those of the blocks with a covariance in the order of the layout; empty
  /// unless accepted.
  Numbers gain;
};

/// Entries of measurements, and memory for numbers that lie nowhere else. A copy has all numbers of
/// its own.
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
  /// One more; references to the others end.
  MeasurementReport& Add(int sensor, Outcome outcome, std::int64_t landmark, int dof) {
    return entries_.emplace_back(sensor, outcome, landmark, dof);
  }
  /// A copy of the values in that memory, until Clear.
  Numbers Copy(Numbers values);
  void Clear() {
    entries_.clear();
    numbers_.clear();
  }

 private:
  std::vector<MeasurementReport> entries_;
  std::vector<std::vector<double>> numbers_;
};

/// Something that happened to the filter, worth a line to its user.
struct Event {
  Timestamp timestamp = kNoTimestamp;
  std::string kind;  ///< one word: diverged, rejection_recovery, conditioning, not_finite, ...
  std::string text;
  bool divergence = false;  ///< the estimator diverged or failed by this
};

/// Parts of the work of a frame, in its order; see Filter.
enum class FramePart { kStep, kEvaluate, kGate, kUpdate, kLandmarks };
inline constexpr int kFrameParts = static_cast<int>(FramePart::kLandmarks) + 1;

/// What one frame did. Filled again and again without allocating.
class UpdateReport {
 public:
  std::span<const MeasurementReport> measurements() const { return measurements_.entries(); }
  std::span<MeasurementReport> measurements() { return measurements_.entries(); }
  /// One more; references to the others end.
  MeasurementReport& Add(int sensor = -1, Outcome outcome = Outcome::kAccepted,
                         std::int64_t landmark = -1, int dof = 0) {
    return measurements_.Add(sensor, outcome, landmark, dof);
  }
  /// A copy of the values in that memory.
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

  bool stale = false;       ///< the frame is older than the state, which stays as it was
  std::vector<int> inputs;  ///< motion models whose control input was taken, as in Problem::motions
  std::vector<Event> events;
  LandmarkCounts landmarks;
  /// Those that the frame removed from the state, as they were then. Those of a batch are not here.
  std::vector<LandmarkEstimate> removed_landmarks;
  /// Time of the wall clock, by FramePart: of filters with landmarks; others take too little.
  std::array<double, kFrameParts> spent_s{};

 private:
  MeasurementReports measurements_;
};

/// An estimator over one problem. It takes values and returns values: it neither reads files nor
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
  /// This estimator as a recursive filter; null: it is not one.
  virtual const Filter* AsFilter() const { return nullptr; }
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
