// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string>

#include "alidade/base/enum_table.h"
#include "alidade/base/timestamp.h"

namespace alidade {

/// Kinds of events, in the order of kEventKinds.
enum class EventKind {
  kDiverged,
  kFailed,
  kStopped,
  kPluginFailed,
  kSensorDisabled,
  kLost,
  kUnit,
  kUnused,
  kNoMeasurement,
  kTruth,
  kUnobservable,
  kObservability,
  kMostlyRejected,
  kRejectionRecovery,
  kRecoveryFailed,
  kRepaired,
  kNotPd,
  kNotFinite,
  kDigitsLost,
  kGuarded,
  kNonlinear,
  kNotConverged,
  kStale,
  kOutOfSequence,
  kInputStale,
  kInputRefused,
  kSubsteps,
  kTooManySubsteps,
  kSolution,
  kNoSolution,
  kInitialEstimate,
  kEdgeOfDomain,
  kSolvedAsAWhole,
  kInexact,
  kSlow,
  kEstimatorSpecific,
};

/// Severity of a kind of event.
enum class EventSeverity {
  kInfo,     ///< recorded for information only
  kWarning,  ///< the estimates may be worse than their covariance indicates
  kError,    ///< the estimator ended, or one of its models failed
};

/// Name, severity and meaning of a kind of event.
struct EventKindInfo {
  EventKind kind;
  const char* name;  ///< name in files
  EventSeverity severity;
  const char* meaning;  ///< description in the documentation
};

/// All kinds of events. To add a kind, add a value of EventKind and an entry here.
inline constexpr std::array kEventKinds = {
    EventKindInfo{EventKind::kDiverged, "diverged", EventSeverity::kError,
                  "an estimate left the domain of a model; if this is a motion model, the "
                  "estimator ended"},
    EventKindInfo{EventKind::kFailed, "failed", EventSeverity::kError,
                  "the estimator failed with an error and ended"},
    EventKindInfo{EventKind::kStopped, "stopped", EventSeverity::kError,
                  "the estimator was stopped before the smoothing finished"},
    EventKindInfo{EventKind::kPluginFailed, "plugin_failed", EventSeverity::kError,
                  "a model of a plugin failed for this measurement"},
    EventKindInfo{EventKind::kSensorDisabled, "sensor_disabled", EventSeverity::kWarning,
                  "the model of a sensor failed; the sensor is not used any more "
                  "(`on_plugin_failure: disable`)"},
    EventKindInfo{EventKind::kLost, "lost", EventSeverity::kWarning,
                  "the error of a block element exceeded 10 sigma for 20 timestamps in a row; "
                  "requires truth"},
    EventKindInfo{EventKind::kUnit, "unit", EventSeverity::kWarning,
                  "the measurements of a sensor are so far from their predictions that their unit "
                  "may differ from the unit of the model, or a role and its block have different "
                  "units"},
    EventKindInfo{EventKind::kUnused, "unused", EventSeverity::kWarning,
                  "the estimator used no measurement of this sensor; the text states the reason"},
    EventKindInfo{
        EventKind::kNoMeasurement, "no_measurement", EventSeverity::kWarning,
        "the estimator used no measurement for a long time, or a sensor had none at the end of the "
        "run"},
    EventKindInfo{EventKind::kTruth, "truth", EventSeverity::kWarning,
                  "the source provides ground truth, but no frame contained a true value"},
    EventKindInfo{EventKind::kUnobservable, "unobservable", EventSeverity::kWarning,
                  "the sensors of this estimator do not determine this direction of the state"},
    EventKindInfo{
        EventKind::kObservability, "observability", EventSeverity::kInfo,
        "unobservable directions were not computed, because the state has more than 500 elements"},
    EventKindInfo{EventKind::kMostlyRejected, "mostly_rejected", EventSeverity::kWarning,
                  "20 measurements of a sensor in a row were rejected, or more than half of its "
                  "measurements over the run"},
    EventKindInfo{EventKind::kRejectionRecovery, "rejection_recovery", EventSeverity::kWarning,
                  "many measurements of a sensor in a row were rejected; the filter reset or "
                  "inflated blocks"},
    EventKindInfo{EventKind::kRecoveryFailed, "recovery_failed", EventSeverity::kWarning,
                  "a sensor is still rejected after five recoveries"},
    EventKindInfo{
        EventKind::kRepaired, "repaired", EventSeverity::kWarning,
        "a covariance lost positive semi-definiteness and was repaired (`max_covariance_repairs`)"},
    EventKindInfo{
        EventKind::kNotPd, "not_pd", EventSeverity::kWarning,
        "S, or P after the update, would not be positive definite; the update was rolled back"},
    EventKindInfo{EventKind::kNotFinite, "not_finite", EventSeverity::kWarning,
                  "a number of a measurement, step or update is not finite; the measurement, step "
                  "or update was not used"},
    EventKindInfo{
        EventKind::kDigitsLost, "digits_lost", EventSeverity::kWarning,
        "rounding errors may change the covariance by 1 % or more, because a prior is too "
        "vague for an accurate measurement"},
    EventKindInfo{EventKind::kGuarded, "guarded", EventSeverity::kWarning,
                  "sigma points left the domain of a model and were moved closer to the estimate"},
    EventKindInfo{EventKind::kNonlinear, "nonlinear", EventSeverity::kWarning,
                  "a sensor is so nonlinear within the uncertainty of the state that the predicted "
                  "mean and covariance are wrong"},
    EventKindInfo{EventKind::kNotConverged, "not_converged", EventSeverity::kWarning,
                  "an iteration ended before it converged"},
    EventKindInfo{EventKind::kStale, "stale", EventSeverity::kWarning,
                  "the frame is older than the state and was not used; consecutive stale frames "
                  "are reported once"},
    EventKindInfo{EventKind::kOutOfSequence, "out_of_sequence", EventSeverity::kWarning,
                  "the frame is older than `out_of_sequence.window_s` allows and was dropped"},
    EventKindInfo{EventKind::kInputStale, "input_stale", EventSeverity::kWarning,
                  "a motion model uses u = 0: no control input has arrived, or the last one is "
                  "older than `timeout_s`"},
    EventKindInfo{
        EventKind::kInputRefused, "input_refused", EventSeverity::kWarning,
        "a control input is not finite or does not have unit length; reported once until an input "
        "is accepted"},
    EventKindInfo{EventKind::kSubsteps, "substeps", EventSeverity::kInfo,
                  "a gap longer than `max_dt_s` was divided into at least twice as many steps as "
                  "the last reported gap"},
    EventKindInfo{EventKind::kTooManySubsteps, "too_many_substeps", EventSeverity::kError,
                  "a gap between timestamps needs more steps than allowed; the estimator ended"},
    EventKindInfo{EventKind::kSolution, "solution", EventSeverity::kInfo,
                  "the batch finished; the text states the number of iterations and whether the "
                  "batch converged"},
    EventKindInfo{EventKind::kNoSolution, "no_solution", EventSeverity::kError,
                  "the batch has no solution"},
    EventKindInfo{EventKind::kInitialEstimate, "initial_estimate", EventSeverity::kWarning,
                  "the filter that provides the initial estimates of the batch ended early"},
    EventKindInfo{EventKind::kEdgeOfDomain, "edge_of_domain", EventSeverity::kWarning,
                  "the solution lies at the edge of the domain of a model"},
    EventKindInfo{
        EventKind::kSolvedAsAWhole, "solved_as_a_whole", EventSeverity::kInfo,
        "an incremental solve was not possible and was replaced by a solve over all data"},
    EventKindInfo{
        EventKind::kInexact, "inexact", EventSeverity::kWarning,
        "variances of the batch may have large rounding errors, because a prior has a very "
        "large sigma"},
    EventKindInfo{
        EventKind::kSlow, "slow", EventSeverity::kInfo,
        "the batch has many noise inputs; the time of a solve grows with the cube of their number"},
    EventKindInfo{EventKind::kEstimatorSpecific, "estimator_specific", EventSeverity::kInfo,
                  "an event of an estimator plugin to which no other kind applies"},
};
static_assert(internal::HasEntryForEach(kEventKinds, &EventKindInfo::kind,
                                        EventKind::kEstimatorSpecific),
              "kEventKinds must have one entry for each EventKind, in the order of EventKind");

/// Returns the entry of a kind.
inline const EventKindInfo& InfoOf(EventKind kind) {
  return kEventKinds[static_cast<std::size_t>(kind)];
}
/// Returns the name that files use for a kind, such as `diverged`.
inline const char* ToString(EventKind kind) { return InfoOf(kind).name; }
/// Returns the name of a severity: `info`, `warning`, `error`.
inline const char* ToString(EventSeverity severity) {
  constexpr std::array kNames = {"info", "warning", "error"};
  return kNames[static_cast<std::size_t>(severity)];
}

/// Event that an estimator reports to its user during a run.
struct Event {
  /// Timestamp of the frame. kNoTimestamp: the event concerns the whole run.
  Timestamp timestamp = kNoTimestamp;
  EventKind kind = EventKind::kEstimatorSpecific;
  std::string text;
  bool divergence = false;  ///< true if the estimator diverged or failed at this event
};

}  // namespace alidade
