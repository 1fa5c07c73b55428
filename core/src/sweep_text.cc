// SPDX-License-Identifier: Apache-2.0
#include "sweep_text.h"

#include <algorithm>

#include "comparison_table.h"

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
