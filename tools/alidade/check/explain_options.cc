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

bool IsCorrected(const RoleBinding& role, const Problem& problem) {
  return role.block >= 0 && role.mode == RoleMode::kEstimate &&
         problem.layout[role.block].status == BlockStatus::kEstimated;
}

/// Returns the action of the rejection recovery for a sensor, with the names of its blocks. Returns
/// "" if the sensor does not correct a block.
std::string RecoveryAction(RejectionRecovery recovery, const SensorBinding& sensor,
                           const Problem& problem) {
  const int determined = sensor.model->inverse().role;  // -1: no inverse model
  std::string reset;
  std::vector<std::string> corrected;
  for (std::size_t i = 0; i < sensor.roles.size(); ++i) {
    if (!IsCorrected(sensor.roles[i], problem)) continue;
    const std::string& name = problem.layout[sensor.roles[i].block].name;
    if (recovery == RejectionRecovery::kReset && static_cast<int>(i) == determined) {
      reset = "reset " + name + " from the measurement";
    } else if (std::ranges::find(corrected, name) == corrected.end()) {
      corrected.push_back(name);
    }
  }
  if (corrected.empty()) return reset;
  if (recovery == RejectionRecovery::kInflate) {
    return "multiply the sigma of " + Join(corrected) + " by 10";
  }
  const std::string widen = "widen " + Join(corrected, " or ");
  if (!reset.empty()) return reset + ", or " + widen + " if it explains the rejections better";
  return corrected.size() == 1 ? widen : widen + ", which explains the rejections best";
}

/// Appends the condition of the rejection recovery, and its action for each sensor.
void AppendRecovery(const EkfOptions& options, const Problem& problem, std::vector<TextRow>& rows) {
  if (options.rejection_recovery == RejectionRecovery::kNone) {
    rows.push_back({"rejection_recovery", "none"});
    return;
  }
  std::vector<TextRow> actions;
  std::vector<std::string> unaffected;
  for (const SensorBinding& sensor : problem.sensors) {
    const std::string action = RecoveryAction(options.rejection_recovery, sensor, problem);
    if (action.empty()) {
      unaffected.push_back(sensor.name);
    } else {
      actions.push_back({"recovery of " + sensor.name, action});
    }
  }
  std::string text = "after " + std::to_string(options.rejection_recovery_after) +
                     " consecutive rejections of a sensor";
  if (std::isfinite(options.rejection_recovery_after_s)) {
    text += " or " + NumberText(options.rejection_recovery_after_s) + " s";
  }
  if (!unaffected.empty()) {
    text += "; no effect for sensors that do not correct a block: " + Join(unaffected);
  }
  rows.push_back({"rejection_recovery", text});
  rows.insert(rows.end(), actions.begin(), actions.end());
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

std::string CapabilitiesText(const std::string& type) {
  const EstimatorType* estimator_type = FindEstimatorType(type);
  if (estimator_type == nullptr) return {};
  const EstimatorCapabilities& capabilities = estimator_type->capabilities;
  const auto either = [](bool supported, const char* text, const char* alternative) {
    return std::string(supported ? text : alternative);
  };
  std::string unsupported;
  const auto add_unsupported = [&](bool supported, const char* feature) {
    if (!supported) unsupported += (unsupported.empty() ? "" : ", ") + std::string(feature);
  };
  add_unsupported(capabilities.consider, "consider blocks and roles");
  add_unsupported(capabilities.at_measurement, "jacobian_at measurement");
  add_unsupported(capabilities.from_measurement, "blocks that start from a measurement");
  add_unsupported(capabilities.recovery, "rejection\n    recovery");
  add_unsupported(capabilities.landmarks, "landmarks");
  return either(capabilities.consider,
                "    blocks estimated, consider (Schmidt) or constant; roles estimate, consider, "
                "known;\n",
                "    blocks estimated or constant; roles estimate, known;\n") +
         "    control inputs; jacobian_at prediction" +
         either(capabilities.at_measurement, " or measurement", "") +
         either(capabilities.from_measurement, "; blocks that start from a measurement", "") +
         ";\n    robust losses" + either(capabilities.landmarks, "; landmarks", "") + '.' +
         (unsupported.empty() ? "" : "\n    Not supported: " + unsupported + '.') + '\n';
}

std::vector<TextRow> OptionRows(const Node& entry, const EstimatorSpec& spec) {
  const Problem& problem = spec.problem;
  std::vector<TextRow> rows;
  if (const EstimatorType* const type = FindEstimatorType(spec.type)) {
    const auto [options, type_rows] = type->describe(entry);
    rows = {{"gate", GateText(options, problem)}, {"fuse", FuseText(options.fuse, problem)}};
    if (type->capabilities.recovery) AppendRecovery(options, problem, rows);
    rows.push_back({"max_dt_s", std::isfinite(options.max_dt_s)
                                    ? NumberText(options.max_dt_s)
                                    : "none: a gap of any length is one step"});
    rows.insert(rows.end(), type_rows.begin(), type_rows.end());
  }
  if (const auto use = entry.Find("use"); use && use->is_map()) {
    rows.push_back({"use", "the measurements that " + use->At("accepted_by").Text() + " accepts"});
  }
  if (const auto error = entry.Find("invariant_error")) {
    std::vector<std::string> blocks;
    for (const Node& block : error->At("blocks").Items()) blocks.push_back(block.Text());
    rows.push_back({"invariant_error", error->At("side").Text() + ", of " + Join(blocks)});
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
