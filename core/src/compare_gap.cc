// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "compare.h"

namespace alidade::internal {
namespace {

/// The estimators that the steps are taken between; null: not there.
struct Partners {
  const Candidate* so_far = nullptr;    ///< the batch of the data so far
  const Candidate* smoother = nullptr;  ///< of the same models, linearised where the filter was
  const Candidate* accepted = nullptr;  ///< the batch of all that the filter accepted
  const Candidate* all = nullptr;       ///< the batch of all data
};

/// Whether both are of the same models and sensors.
bool SameSystem(const EstimatorFacts& a, const EstimatorFacts& b) {
  return a.overrides == b.overrides && std::ranges::is_permutation(a.sensors, b.sensors);
}

Partners PartnersOf(const Candidate& filter, const std::vector<Candidate>& candidates) {
  Partners found;
  const auto keep = [](const Candidate*& place, const Candidate& one) {
    if (place == nullptr) place = &one;
  };
  for (const Candidate& one : candidates) {
    const EstimatorFacts& facts = one.facts();
    if (!SameSystem(facts, filter.facts())) continue;
    const bool by_filter = one.run == filter.run && facts.accepted_by == filter.entry->result.name;
    if (!facts.accepted_by.empty() && !by_filter) continue;
    if (!one.batch() && facts.smoothed && !by_filter) keep(found.smoother, one);
    if (!one.batch()) continue;
    if (facts.smoothed) keep(by_filter ? found.accepted : found.all, one);
    // What the filter did not accept is another step's.
    const bool better =
        by_filter && found.so_far != nullptr && found.so_far->facts().accepted_by.empty();
    if (!facts.smoothed && better) found.so_far = &one;
    if (!facts.smoothed) keep(found.so_far, one);
  }
  return found;
}

GapStep Between(GapKind kind, const Candidate* from, const Candidate* to, bool with_truth,
                const char* missing) {
  GapStep step{kind, "", "", {}, ""};
  if (from != nullptr) step.from = from->name;
  if (to != nullptr) step.to = to->name;
  if (from == nullptr || to == nullptr) {
    step.withheld = missing;
    return step;
  }
  for (const Candidate* const one : {from, to}) {
    if (!one->entry->usable()) step.withheld = "'" + one->name + "' failed";
  }
  if (!step.withheld.empty()) return step;
  const Distance distance = DistanceBetween(from->entry->series, to->entry->series);
  for (const auto& [block, rms] : distance.rms) step.values["apart:" + block] = Single(rms);
  for (const auto& [owner, sigmas] : distance.sigmas) {
    step.values["apart.sigmas:" + owner] = Single(sigmas);
  }
  if (!with_truth) return step;
  for (const auto& [key, rmse] : from->entry->result.metrics) {
    const auto other = to->entry->result.metrics.find(key);
    if (!key.starts_with("rmse:") || key.find('@') != key.npos) continue;
    if (other == to->entry->result.metrics.end()) continue;
    const std::string block = key.substr(5);
    step.values["rmse.from:" + block] = Single(rmse);
    step.values["rmse.to:" + block] = Single(other->second);
    if (other->second > 0.0) step.values["error_ratio:" + block] = Single(rmse / other->second);
  }
  return step;
}

}  // namespace

std::vector<GapStep> ExplainGap(const Candidate& filter, const std::vector<Candidate>& candidates,
                                bool with_truth) {
  const Partners partners = PartnersOf(filter, candidates);
  const auto truth = [&](const Candidate* a, const Candidate* b) {
    return with_truth && a != nullptr && b != nullptr && a->run->reference == "truth" &&
           b->run->reference == "truth";
  };
  std::vector<GapStep> steps;
  steps.push_back(
      Between(GapKind::kLinearisation, &filter, partners.so_far, truth(&filter, partners.so_far),
              "there is no batch of the data so far, {type: ceres_batch, data: so_far}"));
  const bool smoother = partners.smoother != nullptr && partners.smoother->entry->usable();
  const Candidate* const from = smoother ? &filter : partners.so_far;
  const Candidate* const to = smoother                       ? partners.smoother
                              : partners.accepted != nullptr ? partners.accepted
                                                             : partners.all;
  steps.push_back(
      Between(GapKind::kSmoothing, from, to, truth(from, to),
              "there is neither a smoother, {type: rts}, nor batches of all data and of "
              "the data so far"));
  steps.push_back(Between(GapKind::kLostData, partners.accepted, partners.all,
                          truth(partners.accepted, partners.all),
                          "there are no two batches, of all data and of what it accepted, {type: "
                          "ceres_batch, use: {accepted_by: FILTER}}"));
  const std::int64_t all = filter.entry->measurements(), used = filter.entry->used();
  steps.back().values["measurements"] = Single(static_cast<double>(all));
  steps.back().values["lost"] = Single(static_cast<double>(all - used));
  return steps;
}

}  // namespace alidade::internal
