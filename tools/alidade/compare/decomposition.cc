// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "alidade/compare/candidates.h"
#include "alidade/compare/distance.h"

namespace alidade::internal {
namespace {

/// The estimators that the steps are taken between; null: not there.
struct Partners {
  const Candidate* full_information = nullptr;  ///< the full-information filter
  const Candidate* smoother = nullptr;  ///< of the same models, linearised where the filter was
  const Candidate* accepted = nullptr;  ///< the batch of all that the filter accepted
  const Candidate* all = nullptr;       ///< the batch of all data
};

Partners PartnersOf(const Candidate& filter, const std::vector<Candidate>& candidates) {
  Partners found;
  const auto keep = [](const Candidate*& place, const Candidate& one) {
    const bool better = place != nullptr && !place->usable() && one.usable();
    if (place == nullptr || better) place = &one;
  };
  for (const Candidate& one : candidates) {
    const EstimatorResult& result = one.result;
    if (!SameSystem(result, filter.result)) continue;
    const bool by_filter = one.run == filter.run && result.accepted_by == filter.result.name;
    if (!result.accepted_by.empty() && !by_filter) continue;
    if (!one.batch() && SmoothsAllData(result) && !by_filter) keep(found.smoother, one);
    if (!one.batch()) continue;
    if (result.smoothed) keep(by_filter ? found.accepted : found.all, one);
    // What the filter did not accept is another step's.
    const bool better = by_filter && one.usable() && found.full_information != nullptr &&
                        found.full_information->result.accepted_by.empty();
    if (!result.smoothed && better) found.full_information = &one;
    if (!result.smoothed) keep(found.full_information, one);
  }
  return found;
}

/// What an error is of, BLOCK of `rmse:BLOCK`, at the end of `final_error:BLOCK`, or `map`; "": it
/// is not one that a step compares.
std::string SubjectOf(const std::string& metric, bool at_end) {
  if (at_end && metric == "map.rmse") return "map";
  if (at_end && metric == "map.sim3.rmse") return "map.sim3";
  const std::string kind = at_end ? "final_error:" : "rmse:";
  const bool whole = metric.starts_with(kind) && metric.find('@') == metric.npos;
  return whole ? metric.substr(kind.size()) : "";
}

void AddErrors(const EstimatorResult& from, const EstimatorResult& to, DecompositionStep& step) {
  for (const auto& [key, error] : from.metrics) {
    const std::string subject = SubjectOf(key, step.at_end);
    const auto other = to.metrics.find(key);
    if (subject.empty() || other == to.metrics.end()) continue;
    step.values["rmse.from:" + subject] = Single(error);
    step.values["rmse.to:" + subject] = Single(other->second);
    if (other->second > 0.0 && std::isfinite(other->second)) {
      step.ratios["rmse:" + subject] = {error, other->second};
    }
  }
}

/// The step between two; `missing` says what there is to be for it.
DecompositionStep Between(DecompositionKind kind, const Candidate* from, const Candidate* to,
                          bool with_truth, const char* missing, bool at_end = false) {
  DecompositionStep step;
  step.kind = kind;
  step.at_end = at_end;
  if (from != nullptr) step.from = from->name;
  if (to != nullptr) step.to = to->name;
  if (from == nullptr || to == nullptr) {
    step.withheld = missing;
    return step;
  }
  for (const Candidate* const one : {from, to}) {
    if (!one->usable()) step.withheld = "'" + one->name + "' failed";
  }
  if (!step.withheld.empty()) return step;
  const Distance distance = DistanceBetween(from->series, to->series);
  for (const auto& [block, d] : at_end ? distance.final : distance.rms) {
    step.values["rmsd:" + block] = Single(d);
  }
  for (const auto& [owner, sigmas] : at_end ? distance.final_sigmas : distance.sigmas) {
    step.values["rmsd.sigmas:" + owner] = Single(sigmas);
  }
  if (at_end) {
    for (const auto& [map, d] : DistanceBetweenMaps(from->result, to->result)) {
      step.values["rmsd:" + map] = Single(d);
    }
  }
  const bool truth = from->run->reference == "truth" && to->run->reference == "truth";
  if (with_truth && truth) AddErrors(from->result, to->result, step);
  return step;
}

/// The filter against the full-information filter. Where there is none, as with landmarks, at the
/// last frame against a batch of all data: there the two are the same.
DecompositionStep Linearisation(const Candidate& filter, const Partners& partners,
                                bool with_truth) {
  const bool accepted = partners.accepted != nullptr && partners.accepted->usable();
  const Candidate* const of_end = accepted ? partners.accepted : partners.all;
  const bool at_end = partners.full_information == nullptr && of_end != nullptr;
  return Between(DecompositionKind::kLinearisation, &filter,
                 at_end ? of_end : partners.full_information, with_truth,
                 "there is no full-information filter, {type: BATCH, mode: filtering}", at_end);
}

}  // namespace

bool SameSensors(const EstimatorResult& a, const EstimatorResult& b) {
  return std::ranges::is_permutation(a.sensors, b.sensors);
}

bool SameSystem(const EstimatorResult& a, const EstimatorResult& b) {
  return a.overrides == b.overrides && SameSensors(a, b);
}

std::map<std::string, double> DistanceBetweenMaps(const EstimatorResult& map,
                                                  const EstimatorResult& reference) {
  if (!map.landmarks || !reference.landmarks) return {};
  Eigen::Matrix3Xd points(3, std::ssize(*map.landmarks)), onto = points;
  Eigen::Index count = 0;
  for (const LandmarkEstimate& one : *map.landmarks) {
    for (const LandmarkEstimate& other : *reference.landmarks) {
      const bool same = one.id == other.id && one.generation == other.generation;
      if (!same || !one.position.allFinite() || !other.position.allFinite()) continue;
      points.col(count) = one.position;
      onto.col(count++) = other.position;
      break;
    }
  }
  if (count == 0) return {};
  points.conservativeResize(Eigen::NoChange, count);
  onto.conservativeResize(Eigen::NoChange, count);
  std::map<std::string, double> distances;
  distances["map"] = std::sqrt((points - onto).squaredNorm() / static_cast<double>(count));
  if (const auto aligned = AlignBySimilarity(points, onto)) distances["map.sim3"] = aligned->rmse;
  return distances;
}

std::vector<DecompositionStep> Decompose(const Candidate& filter,
                                         const std::vector<Candidate>& candidates,
                                         bool with_truth) {
  const Partners partners = PartnersOf(filter, candidates);
  std::vector<DecompositionStep> steps = {Linearisation(filter, partners, with_truth)};
  const bool smoother = partners.smoother != nullptr && partners.smoother->usable();
  steps.push_back(
      Between(DecompositionKind::kSmoothing, smoother ? &filter : partners.full_information,
              smoother                       ? partners.smoother
              : partners.accepted != nullptr ? partners.accepted
                                             : partners.all,
              with_truth,
              "there is neither a smoother, {type: rts}, nor a batch of all data with a "
              "full-information filter"));
  steps.push_back(Between(DecompositionKind::kRejected, partners.accepted, partners.all, with_truth,
                          "there are no two batches, of all data and of what it accepted, {type: "
                          "BATCH, use: {accepted_by: FILTER}}"));
  const std::int64_t all = filter.measurements(), used = filter.used();
  steps.back().values["measurements"] = Single(static_cast<double>(all));
  steps.back().values["rejected"] = Single(static_cast<double>(all - used));
  return steps;
}

}  // namespace alidade::internal
