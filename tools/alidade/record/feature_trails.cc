// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/feature_trails.h"

#include <algorithm>
#include <utility>

namespace alidade::internal {

Mark MarkOf(Outcome outcome) {
  const OutcomeInfo& info = InfoOf(outcome);
  return outcome == Outcome::kAccepted ? Mark::kAccepted
         : info.starts                 ? Mark::kNew
         : info.is_gated               ? Mark::kRejected
                                       : Mark::kUnused;
}

std::vector<ViewFeature> FeatureTrails::Take(const Frame& frame, const UpdateReport* report) {
  constexpr std::size_t kTail = 8;  // places of a feature before the present one
  std::vector<ViewFeature> features;
  std::map<std::int64_t, Trail> now;
  for (const Measurement& m : frame.measurements) {
    if (m.landmark < 0 || m.values.size() < 2 || now.contains(m.landmark)) continue;
    ViewFeature feature = FeatureOf(m, report);
    Trail& trail = now[m.landmark];
    if (const auto before = trails_.find(m.landmark); before != trails_.end()) {
      trail = before->second;
    }
    feature.tail = trail;
    trail.push_back(feature.at);
    if (trail.size() > kTail) trail.erase(trail.begin());
    features.push_back(std::move(feature));
  }
  for (const auto& [id, trail] : trails_) {
    if (!now.contains(id)) features.push_back({Mark::kLost, trail.back(), std::nullopt, trail});
  }
  trails_ = std::move(now);
  return features;
}

ViewFeature FeatureTrails::FeatureOf(const Measurement& m, const UpdateReport* report) {
  ViewFeature feature{Mark::kUnused, {m.values[0], m.values[1]}, std::nullopt};
  const MeasurementReport* found = nullptr;
  if (report != nullptr) {
    const auto all = report->measurements();
    const auto it = std::ranges::find(all, m.landmark, &MeasurementReport::landmark);
    if (it != all.end()) found = &*it;
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
