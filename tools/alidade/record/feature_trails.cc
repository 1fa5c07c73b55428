// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/feature_trails.h"

#include <algorithm>
#include <utility>

namespace alidade::internal {

Mark MarkOf(Outcome outcome) {
  const OutcomeInfo& info = InfoOf(outcome);
  return outcome == Outcome::kAccepted ? Mark::kAccepted
         : info.is_initialisation      ? Mark::kNew
         : info.is_gated               ? Mark::kRejected
                                       : Mark::kUnused;
}

std::vector<ViewFeature> FeatureTrails::Add(const Frame& frame, const UpdateReport* report) {
  constexpr std::size_t kMaxTrail = 8;  // maximum number of earlier positions of a feature
  std::vector<ViewFeature> features;
  std::map<std::int64_t, Trail> current_trails;
  for (const Measurement& m : frame.measurements) {
    if (m.landmark < 0 || m.values.size() < 2 || current_trails.contains(m.landmark)) continue;
    ViewFeature feature = FeatureOf(m, report);
    Trail& trail = current_trails[m.landmark];
    if (const auto previous = trails_.find(m.landmark); previous != trails_.end()) {
      trail = previous->second;
    }
    feature.trail = trail;
    trail.push_back(feature.pixel);
    if (trail.size() > kMaxTrail) trail.erase(trail.begin());
    features.push_back(std::move(feature));
  }
  for (const auto& [id, trail] : trails_) {
    if (!current_trails.contains(id))
      features.push_back({Mark::kLost, trail.back(), std::nullopt, trail});
  }
  trails_ = std::move(current_trails);
  return features;
}

ViewFeature FeatureTrails::FeatureOf(const Measurement& m, const UpdateReport* report) {
  ViewFeature feature{Mark::kUnused, {m.values[0], m.values[1]}, std::nullopt};
  const MeasurementReport* found = nullptr;
  if (report != nullptr) {
    const auto reports = report->measurements();
    const auto iterator = std::ranges::find(reports, m.landmark, &MeasurementReport::landmark);
    if (iterator != reports.end()) found = &*iterator;
  }
  if (found == nullptr) {
    if (!accepted_.contains(m.landmark)) feature.mark = Mark::kNew;
    return feature;
  }
  feature.mark = MarkOf(found->outcome);
  if (feature.mark == Mark::kAccepted) accepted_.insert(m.landmark);
  const auto dof = static_cast<std::size_t>(found->dof);
  if (found->h.size() >= 2 && dof >= 2 && found->s.size() == dof * dof) {
    feature.predicted = {found->h[0], found->h[1], found->s[0], found->s[1], found->s[dof + 1]};
  }
  return feature;
}

}  // namespace alidade::internal
