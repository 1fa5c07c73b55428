// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/table.h"

#include <algorithm>
#include <string_view>

#include "alidade/base/number_text.h"
#include "alidade/run/metric_rows.h"

namespace alidade::internal {
namespace {

/// "" where metrics compare with truth.
std::string ReferenceText(const SweepResult& result) {
  RunResult of_runs;
  of_runs.reference = result.reference;
  const std::string text = internal::ReferenceText(of_runs);
  const std::int64_t withheld = CountWithheld(result);
  if (withheld == 0) return text;
  return text + "; withheld in " + std::to_string(withheld) + " of " +
         std::to_string(CountWhole(result)) +
         " runs, in which it failed, diverged or had no estimates";
}

}  // namespace

std::int64_t CountWhole(const SweepResult& result) {
  return std::ranges::count(result.done, RunStatus::kOk, &SweepRun::status);
}

std::int64_t CountWithheld(const SweepResult& result) {
  return std::ranges::count_if(result.done, [](const SweepRun& run) {
    return run.status == RunStatus::kOk && run.withheld;
  });
}

std::map<std::string, Interval> NeesBounds(const SweepSummary& summary) {
  constexpr std::string_view kDof = "nees.dof:";
  std::map<std::string, Interval> bounds;
  for (const auto& [key, dof] : summary.metrics) {
    if (!key.starts_with(kDof) || summary.used == 0) continue;
    bounds["nees.mean:" + key.substr(kDof.size())] =
        ConsistencyBounds(dof.mean, static_cast<double>(summary.used));
  }
  return bounds;
}

std::string NeesLines(const std::vector<SweepSummary>& summaries) {
  std::string lines;
  for (const SweepSummary& summary : summaries) {
    for (const auto& [key, bounds] : NeesBounds(summary)) {
      const auto mean = summary.metrics.find(key);
      if (mean == summary.metrics.end()) continue;
      const double value = mean->second.mean;
      if (value >= bounds.low && value <= bounds.high) continue;
      lines += summary.name + ": NEES mean " + RoundedText(value, 3) + " of " +
               key.substr(key.find(':') + 1) + " over " + std::to_string(summary.used) +
               " runs is outside its 95 % bounds [" + RoundedText(bounds.low, 3) + ", " +
               RoundedText(bounds.high, 3) + "]: the filter is " +
               (value > bounds.high ? "overconfident" : "underconfident") + '\n';
    }
  }
  return lines.empty() ? "" : '\n' + lines;
}

std::string ReferenceLines(const SweepResult& result) {
  const std::string text = ReferenceText(result);
  return text.empty() ? "" : '\n' + text + '\n';
}

std::string ReferenceLines(const VariedSweep& sweep) {
  std::string lines;
  bool all_same = true;
  for (std::size_t v = 0; v < sweep.results.size(); ++v) {
    const std::string text = ReferenceText(sweep.results[v]);
    all_same = all_same && text == ReferenceText(sweep.results.front());
    lines += '\n' + sweep.variation.values[v] + ": " +
             (text.empty() ? "errors are differences from truth" : text) + '\n';
  }
  return all_same ? ReferenceLines(sweep.results.front()) : lines;
}

}  // namespace alidade::internal
