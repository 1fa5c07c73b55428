// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "alidade/compare/candidates.h"
#include "alidade/compare/distance.h"

namespace alidade::internal {
namespace {

/// Estimators between which the steps are computed. A pointer is null if the estimator is missing.
struct StepEstimators {
  const Candidate* full_information = nullptr;  ///< full-information filter
  /// Smoother with the models and the linearisation of the filter.
  const Candidate* smoother = nullptr;
  const Candidate* accepted = nullptr;  ///< batch of the accepted measurements
  const Candidate* all_data = nullptr;  ///< batch of all data
};

StepEstimators FindStepEstimators(const Candidate& filter,
                                  const std::vector<Candidate>& candidates) {
  StepEstimators found;
  const auto select = [](const Candidate*& selected, const Candidate& candidate) {
    const bool is_better = selected != nullptr && !selected->is_usable() && candidate.is_usable();
    if (selected == nullptr || is_better) selected = &candidate;
  };
  for (const Candidate& candidate : candidates) {
    const EstimatorResult& result = candidate.result;
    if (!HaveSameProblem(result, filter.result)) continue;
    const bool by_filter = candidate.run == filter.run && result.accepted_by == filter.result.name;
    if (!result.accepted_by.empty() && !by_filter) continue;
    if (!candidate.is_batch() && SmoothsAllData(result) && !by_filter) {
      select(found.smoother, candidate);
    }
    if (!candidate.is_batch()) continue;
    if (result.smoothed) select(by_filter ? found.accepted : found.all_data, candidate);
    // A full-information filter of the accepted measurements is preferred, because the effect of
    // the rejected measurements is a separate step.
    const bool is_better = by_filter && candidate.is_usable() &&
                           found.full_information != nullptr &&
                           found.full_information->result.accepted_by.empty();
    if (!result.smoothed && is_better) found.full_information = &candidate;
    if (!result.smoothed) select(found.full_information, candidate);
  }
  return found;
}

/// Returns the subject of an error metric. The subject is BLOCK for `rmse:BLOCK`. If `at_end` is
/// true, the subject is BLOCK for `final_error:BLOCK`, `map` or `map.sim3`. Returns "" if a step
/// does not compare the metric.
std::string SubjectOf(const std::string& metric, bool at_end) {
  if (at_end && metric == "map.rmse") return "map";
  if (at_end && metric == "map.sim3.rmse") return "map.sim3";
  const std::string kind = at_end ? "final_error:" : "rmse:";
  const bool is_error = metric.starts_with(kind) && metric.find('@') == metric.npos;
  return is_error ? metric.substr(kind.size()) : "";
}

void AddErrors(const EstimatorResult& start, const EstimatorResult& end, DecompositionStep& step) {
  for (const auto& [key, error] : start.metrics) {
    const std::string subject = SubjectOf(key, step.at_end);
    const auto end_error = end.metrics.find(key);
    if (subject.empty() || end_error == end.metrics.end()) continue;
    step.values["rmse.from:" + subject] = SingleValue(error);
    step.values["rmse.to:" + subject] = SingleValue(end_error->second);
    if (end_error->second > 0.0 && std::isfinite(end_error->second)) {
      step.ratios["rmse:" + subject] = {error, end_error->second};
    }
  }
}

/// Computes the step between two estimators. If an estimator is null, the step is withheld with the
/// reason `missing_reason`.
DecompositionStep ComputeStep(DecompositionKind kind, const Candidate* start, const Candidate* end,
                              bool with_truth, const char* missing_reason, bool at_end = false) {
  DecompositionStep step;
  step.kind = kind;
  step.at_end = at_end;
  if (start != nullptr) step.estimator = start->name;
  if (end != nullptr) step.reference = end->name;
  if (start == nullptr || end == nullptr) {
    step.withheld = missing_reason;
    return step;
  }
  for (const Candidate* const candidate : {start, end}) {
    if (!candidate->is_usable())
      step.withheld = "'" + candidate->name + "' failed or has no estimates";
  }
  if (!step.withheld.empty()) return step;
  const Distance distance = DistanceBetween(start->series, end->series);
  for (const auto& [block, d] : at_end ? distance.final : distance.rms) {
    step.values["rmsd:" + block] = SingleValue(d);
  }
  for (const auto& [owner, sigmas] : at_end ? distance.final_sigmas : distance.sigmas) {
    step.values["rmsd.sigmas:" + owner] = SingleValue(sigmas);
  }
  if (at_end) {
    for (const auto& [map, d] : DistanceBetweenMaps(start->result, end->result)) {
      step.values["rmsd:" + map] = SingleValue(d);
    }
  }
  const bool has_truth = start->run->reference == "truth" && end->run->reference == "truth";
  if (with_truth && has_truth) AddErrors(start->result, end->result, step);
  return step;
}

/// Compares the filter with the full-information filter. If no full-information filter exists, for
/// example with landmarks, compares the filter with a batch at the last frame. At that frame, the
/// batch equals the full-information filter.
DecompositionStep LinearisationStep(const Candidate& filter, const StepEstimators& estimators,
                                    bool with_truth) {
  const bool has_accepted = estimators.accepted != nullptr && estimators.accepted->is_usable();
  const Candidate* const batch = has_accepted ? estimators.accepted : estimators.all_data;
  const bool at_end = estimators.full_information == nullptr && batch != nullptr;
  return ComputeStep(DecompositionKind::kLinearisation, &filter,
                     at_end ? batch : estimators.full_information, with_truth,
                     "this step needs a full-information filter: add a batch estimator with `mode: "
                     "filtering` to the config",
                     at_end);
}

}  // namespace

bool HaveSameSensors(const EstimatorResult& a, const EstimatorResult& b) {
  return std::ranges::is_permutation(a.sensors, b.sensors);
}

bool HaveSameProblem(const EstimatorResult& a, const EstimatorResult& b) {
  return a.overrides == b.overrides && HaveSameSensors(a, b);
}

std::map<std::string, double> DistanceBetweenMaps(const EstimatorResult& map,
                                                  const EstimatorResult& reference) {
  if (!map.landmarks || !reference.landmarks) return {};
  Eigen::Matrix3Xd points(3, std::ssize(*map.landmarks)), reference_points = points;
  Eigen::Index count = 0;
  for (const LandmarkEstimate& landmark : *map.landmarks) {
    for (const LandmarkEstimate& candidate : *reference.landmarks) {
      const bool is_same =
          landmark.id == candidate.id && landmark.generation == candidate.generation;
      if (!is_same || !landmark.position.allFinite() || !candidate.position.allFinite()) continue;
      points.col(count) = landmark.position;
      reference_points.col(count++) = candidate.position;
      break;
    }
  }
  if (count == 0) return {};
  points.conservativeResize(Eigen::NoChange, count);
  reference_points.conservativeResize(Eigen::NoChange, count);
  std::map<std::string, double> distances;
  distances["map"] =
      std::sqrt((points - reference_points).squaredNorm() / static_cast<double>(count));
  if (const auto aligned = AlignBySimilarity(points, reference_points))
    distances["map.sim3"] = aligned->rmse;
  return distances;
}

std::vector<DecompositionStep> Decompose(const Candidate& filter,
                                         const std::vector<Candidate>& candidates,
                                         bool with_truth) {
  const StepEstimators estimators = FindStepEstimators(filter, candidates);
  std::vector<DecompositionStep> steps = {LinearisationStep(filter, estimators, with_truth)};
  const bool has_smoother = estimators.smoother != nullptr && estimators.smoother->is_usable();
  steps.push_back(ComputeStep(
      DecompositionKind::kSmoothing, has_smoother ? &filter : estimators.full_information,
      has_smoother                     ? estimators.smoother
      : estimators.accepted != nullptr ? estimators.accepted
                                       : estimators.all_data,
      with_truth,
      "this step needs a smoother, or a full-information filter and a batch of all data: add an "
      "estimator with `type: rts` to the config"));
  steps.push_back(ComputeStep(
      DecompositionKind::kRejected, estimators.accepted, estimators.all_data, with_truth,
      "this step needs two batch estimators, one with all data and one with `use: {accepted_by: "
      "FILTER}`: add the missing estimator to the config"));
  const std::int64_t count = filter.measurements(), used = filter.used();
  steps.back().values["measurements"] = SingleValue(static_cast<double>(count));
  steps.back().values["rejected"] = SingleValue(static_cast<double>(count - used));
  return steps;
}

}  // namespace alidade::internal
