// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/over_seeds.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "alidade/base/error.h"
#include "alidade/base/random.h"

namespace alidade {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// Quantiles of sum(a_i) / sum(b_i) over samples of the n pairs, drawn with replacement.
Interval Bootstrap(const std::vector<double>& a, const std::vector<double>& b) {
  constexpr int kSamples = 5000;
  constexpr std::uint64_t kSeed = 1;
  Random random(kSeed);
  const auto n = static_cast<double>(a.size());
  std::vector<double> ratios(kSamples);
  for (double& ratio : ratios) {
    double sum_a = 0.0, sum_b = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      const auto drawn = static_cast<std::size_t>(random.Uniform() * n);
      sum_a += a[drawn];
      sum_b += b[drawn];
    }
    ratio = sum_a / sum_b;
  }
  std::ranges::sort(ratios);
  return {Quantile(ratios, 0.025), Quantile(ratios, 0.975)};
}

/// What the runs have at one timestamp.
struct AtTimestamp {
  std::vector<std::vector<double>> errors;  ///< |e|, by block
  std::vector<double> bounds;               ///< sums of tr P, by block
  std::vector<double> nees, dofs;           ///< sums, by owner
  std::vector<std::int64_t> runs;           ///< with a NEES, by owner
  std::int64_t count = 0, bounded = 0;      ///< runs, and those with a bound
};

void Gather(const ErrorSeries& run, std::map<Timestamp, AtTimestamp>& all) {
  const std::size_t blocks = run.blocks.size(), owners = run.owners.size();
  for (std::size_t k = 0; k < run.timestamps.size(); ++k) {
    AtTimestamp& at = all[run.timestamps[k]];
    at.errors.resize(blocks);
    at.bounds.resize(blocks);
    at.nees.resize(owners);
    at.dofs.resize(owners);
    at.runs.resize(owners);
    ++at.count;
    for (std::size_t i = 0; i < blocks; ++i) {
      const double square = run.squares[k * blocks + i];
      if (std::isfinite(square)) at.errors[i].push_back(std::sqrt(square));
    }
    at.bounded += run.bounds.empty() ? 0 : 1;
    for (std::size_t i = 0; i < blocks && !run.bounds.empty(); ++i) {
      at.bounds[i] += run.bounds[k * blocks + i];
    }
    for (std::size_t i = 0; i < owners; ++i) {
      if (!std::isfinite(run.nees[k * owners + i])) continue;
      at.nees[i] += run.nees[k * owners + i];
      at.dofs[i] += run.dofs[k * owners + i];
      ++at.runs[i];
    }
  }
}

void AddError(std::vector<double>& errors, OverTime::Error& to) {
  const bool known = errors.size() > 1;
  double sum = 0.0;
  for (const double e : errors) sum += e * e;
  std::ranges::sort(errors);
  to.rms.push_back(known ? std::sqrt(sum / static_cast<double>(errors.size())) : kUnknown);
  to.low.push_back(known ? Quantile(errors, 0.16) : kUnknown);
  to.high.push_back(known ? Quantile(errors, 0.84) : kUnknown);
}

/// Sum of e' C^-1 e of so many runs, and of their degrees of freedom.
void AddNees(double nees, double dof, std::int64_t runs, OverTime::AverageNees& to) {
  const bool known = runs > 1;
  const Interval bounds = known ? ConsistencyBounds(dof, 1.0) : Interval{kUnknown, kUnknown};
  const double mean = known ? nees / dof : kUnknown;
  to.mean.push_back(mean);
  to.low.push_back(bounds.low);
  to.high.push_back(bounds.high);
  if (!known) return;
  ++to.timestamps;
  to.inside += mean >= bounds.low && mean <= bounds.high ? 1.0 : 0.0;
}

}  // namespace

Ratio RatioOfMeans(const std::vector<Ratio>& runs) {
  ALIDADE_EXPECTS(!runs.empty());
  Ratio mean;
  mean.runs = std::ssize(runs);
  std::vector<double> errors, references;
  for (const Ratio& run : runs) {
    errors.push_back(run.error);
    references.push_back(run.reference_error);
    mean.error += run.error / static_cast<double>(mean.runs);
    mean.reference_error += run.reference_error / static_cast<double>(mean.runs);
  }
  if (mean.runs > 1) mean.interval = Bootstrap(errors, references);
  return mean;
}

Interval IntervalOfMean(const std::vector<double>& values) {
  ALIDADE_EXPECTS(!values.empty());
  return Bootstrap(values, std::vector<double>(values.size(), 1.0));
}

OverTime OverRuns(const std::vector<const ErrorSeries*>& runs) {
  std::map<Timestamp, AtTimestamp> all;
  for (const ErrorSeries* const run : runs) Gather(*run, all);
  OverTime over_time;
  if (runs.empty()) return over_time;
  const ErrorSeries& first = *runs.front();
  for (auto& [timestamp, at] : all) {
    if (at.count < 2) continue;
    over_time.timestamps.push_back(timestamp);
    for (std::size_t i = 0; i < first.blocks.size(); ++i) {
      OverTime::Error& error = over_time.errors[first.blocks[i]];
      error.is_angle = first.angles[i];
      AddError(at.errors[i], error);
      if (at.bounded == at.count) {
        error.bound.push_back(std::sqrt(at.bounds[i] / static_cast<double>(at.count)));
      }
    }
    for (std::size_t i = 0; i < first.owners.size(); ++i) {
      AddNees(at.nees[i], at.dofs[i], at.runs[i], over_time.nees[first.owners[i]]);
    }
  }
  for (auto& [block, error] : over_time.errors) {
    if (error.bound.size() != error.rms.size()) error.bound.clear();
  }
  const auto unknown = [](double value) { return std::isnan(value); };
  std::erase_if(over_time.errors,
                [&](const auto& of) { return std::ranges::all_of(of.second.rms, unknown); });
  std::erase_if(over_time.nees, [](const auto& of) { return of.second.timestamps == 0; });
  for (auto& [owner, nees] : over_time.nees) nees.inside /= static_cast<double>(nees.timestamps);
  return over_time;
}

}  // namespace alidade
