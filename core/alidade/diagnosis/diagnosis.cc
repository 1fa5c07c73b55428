// SPDX-License-Identifier: Apache-2.0
#include "alidade/diagnosis/diagnosis.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "alidade/diagnosis/diagnosis_rules.h"

namespace alidade {
namespace {

using internal::InnovationView;

using Rule = std::optional<Finding> (*)(const InnovationView& view);

constexpr Rule kGrossErrorRules[] = {
    internal::TestTimeUnit,   internal::TestUnit, internal::TestPrior, internal::TestDomain,
    internal::TestRejections, internal::TestSwap, internal::TestStuck};
constexpr Rule kNoiseRules[] = {internal::TestNoiseModel, internal::TestTails,
                                internal::TestElements,   internal::TestTimeOffset,
                                internal::TestBias,       internal::TestCorrelation,
                                internal::TestScaleOfNis};

void Apply(std::span<const Rule> rules, const InnovationView& view,
           std::vector<Finding>& findings) {
  for (const Rule rule : rules) {
    if (std::optional<Finding> finding = rule(view)) findings.push_back(*std::move(finding));
  }
}

}  // namespace

std::vector<Finding> Diagnose(std::span<const InnovationSeries> sensors) {
  std::vector<Finding> findings;
  for (const InnovationSeries& series : sensors) {
    const InnovationView view(series);
    Apply(kGrossErrorRules, view, findings);
    if (series.accepted_frames() >= kMinDiagnosedFrames) Apply(kNoiseRules, view, findings);
  }
  std::ranges::stable_sort(findings, {}, &Finding::kind);
  return findings;
}

}  // namespace alidade
