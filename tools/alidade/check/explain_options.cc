// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>

#include "alidade/base/number_text.h"
#include "alidade/base/statistics.h"
#include "alidade/base/text.h"
#include "alidade/check/explain_parts.h"
#include "alidade/experiment/estimator_registry.h"

namespace alidade::internal {
namespace {

std::string GateText(const EkfOptions& options, const Problem& problem) {
  if (options.gate >= 1.0) return "none: every measurement is used";
  std::map<int, std::string> thresholds;
  for (const SensorBinding& sensor : problem.sensors) {
    const int dof = sensor.model->measurement().geometry.tangent;
    thresholds[dof] = FixedText(ChiSquareQuantile(options.gate, dof), 2);
  }
  std::vector<std::string> parts;
  for (const auto& [dof, threshold] : thresholds) {
    parts.push_back(threshold + " for " + std::to_string(dof) + " dof");
  }
  return NumberText(options.gate) + ": accepts r' S^-1 r up to " + Join(parts);
}

std::string FuseText(Fuse fuse, const Problem& problem) {
  const std::vector<std::string> names = NamesOf(problem.sensors);
  switch (fuse) {
    case Fuse::kJoint:
      return "joint: one stacked update for each timestamp";
    case Fuse::kPerSensor:
      return "per_sensor: one update for each sensor, in the order " + Join(names);
    case Fuse::kPerMeasurement:
      break;
  }
  return "per_measurement: one update for each measurement, in the order " + Join(names);
}

std::string RejectionRecoveryText(const EkfOptions& options, const Problem& problem) {
  const auto corrects = [&](const RoleBinding& role) {
    return role.block >= 0 && role.mode == RoleMode::kEstimate &&
           problem.layout[role.block].status == BlockStatus::kEstimated;
  };
  std::vector<std::string> unaffected;
  for (const SensorBinding& sensor : problem.sensors) {
    if (std::ranges::none_of(sensor.roles, corrects)) unaffected.push_back(sensor.name);
  }
  std::string after = " after " + std::to_string(options.rejection_recovery_after) +
                      " consecutive rejections of a sensor";
  if (std::isfinite(options.rejection_recovery_after_s)) {
    after += " or " + NumberText(options.rejection_recovery_after_s) + " s";
  }
  if (!unaffected.empty()) {
    after += "; no effect for sensors that do not correct a block: " + Join(unaffected);
  }
  switch (options.rejection_recovery) {
    case RejectionRecovery::kReset:
      return "reset the block that the sensor determines, or widen the block that explains the "
             "rejections best," +
             after;
    case RejectionRecovery::kInflate:
      return "inflate the covariance of the blocks of the sensor," + after;
    case RejectionRecovery::kNone:
      break;
  }
  return "none";
}

std::string LossText(const Problem& problem) {
  std::vector<std::string> losses;
  for (const SensorBinding& sensor : problem.sensors) {
    if (sensor.loss.kind == LossKind::kNone) continue;
    losses.push_back(sensor.name + ": " + ToString(sensor.loss.kind) + ' ' +
                     NumberText(sensor.loss.scale));
  }
  return Join(losses);
}

}  // namespace

std::vector<TextRow> OptionRows(const Node& entry, const EstimatorSpec& spec) {
  const Problem& problem = spec.problem;
  std::vector<TextRow> rows;
  if (const EstimatorType* const type = FindEstimatorType(spec.type)) {
    const auto [options, type_rows] = type->describe(entry);
    rows = {{"gate", GateText(options, problem)}, {"fuse", FuseText(options.fuse, problem)}};
    if (type->capabilities.recovery)
      rows.push_back({"rejection_recovery", RejectionRecoveryText(options, problem)});
    rows.push_back({"max_dt_s", std::isfinite(options.max_dt_s)
                                    ? NumberText(options.max_dt_s)
                                    : "none: a gap of any length is one step"});
    rows.insert(rows.end(), type_rows.begin(), type_rows.end());
  }
  if (const auto use = entry.Find("use"); use && use->is_map()) {
    rows.push_back({"use", "the measurements that " + use->At("accepted_by").Text() + " accepts"});
  }
  rows.push_back({"on_divergence", spec.on_divergence == OnDivergence::kFail
                                       ? "fail: the run ends with exit code 79"
                                       : "report: the run continues"});
  if (spec.on_plugin_failure != OnPluginFailure::kSkip) {
    rows.push_back(
        {"on_plugin_failure", spec.on_plugin_failure == OnPluginFailure::kAbort
                                  ? "abort: the run ends with exit code 69"
                                  : "disable: a sensor is disabled after a failed call"});
  }
  if (const std::string losses = LossText(problem); !losses.empty()) {
    rows.push_back({"loss", losses});
  }
  if (problem.initial_time_s)
    rows.push_back({"initial_time_s", NumberText(*problem.initial_time_s)});
  return rows;
}

}  // namespace alidade::internal
