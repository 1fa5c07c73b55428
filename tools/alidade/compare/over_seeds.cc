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

/// Computes the 2.5 and 97.5 % quantiles of sum(a_i) / sum(b_i) over random samples. A sample
/// consists of n pairs (a_i, b_i), which are drawn with replacement.
Interval Bootstrap(const std::vector<double>& a, const std::vector<double>& b) {
  constexpr int kSamples = 5000;
  constexpr std::uint64_t kSeed = 1;
  Random random(kSeed);
  const auto n = static_cast<double>(a.size());
  std::vector<double> ratios(kSamples);
  for (double& ratio : ratios) {
    double sum_a = 0.0, sum_b = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      const auto index = static_cast<std::size_t>(random.Uniform() * n);
      sum_a += a[index];
      sum_b += b[index];
    }
    ratio = sum_a / sum_b;
  }
  std::ranges::sort(ratios);
  return {Quantile(ratios, 0.025), Quantile(ratios, 0.975)};
}

/// Errors and NEES of the runs at one timestamp.
struct TimestampStatistics {
  std::vector<std::vector<double>> errors;  ///< for each block: |e| of each run
  std::vector<double> bounds;               ///< for each block: sum of tr P over the runs
  std::vector<double> nees, dofs;           ///< for each owner: sums over the runs
  std::vector<std::int64_t> runs;           ///< for each owner: number of runs with a NEES
  std::int64_t count = 0;                   ///< number of runs
  std::int64_t bound_count = 0;             ///< number of runs with a bound
};

void AddRun(const ErrorSeries& run, std::map<Timestamp, TimestampStatistics>& by_timestamp) {
  const std::size_t blocks = run.blocks.size(), owners = run.owners.size();
  for (std::size_t k = 0; k < run.timestamps.size(); ++k) {
    TimestampStatistics& statistics = by_timestamp[run.timestamps[k]];
    statistics.errors.resize(blocks);
    statistics.bounds.resize(blocks);
    statistics.nees.resize(owners);
    statistics.dofs.resize(owners);
    statistics.runs.resize(owners);
    ++statistics.count;
    for (std::size_t i = 0; i < blocks; ++i) {
      const double square = run.squares[k * blocks + i];
      if (std::isfinite(square)) statistics.errors[i].push_back(std::sqrt(square));
    }
    statistics.bound_count += run.bounds.empty() ? 0 : 1;
    for (std::size_t i = 0; i < blocks && !run.bounds.empty(); ++i) {
      statistics.bounds[i] += run.bounds[k * blocks + i];
    }
    for (std::size_t i = 0; i < owners; ++i) {
      if (!std::isfinite(run.nees[k * owners + i])) continue;
      statistics.nees[i] += run.nees[k * owners + i];
      statistics.dofs[i] += run.dofs[k * owners + i];
      ++statistics.runs[i];
    }
  }
}

/// Appends the statistics of the errors at one timestamp. Appends NaN if there are fewer than two
/// errors.
void AppendError(std::vector<double>& errors, OverTime::Error& destination) {
  const bool is_known = errors.size() > 1;
  double sum = 0.0;
  for (const double e : errors) sum += e * e;
  std::ranges::sort(errors);
  destination.rms.push_back(is_known ? std::sqrt(sum / static_cast<double>(errors.size()))
                                     : kUnknown);
  destination.low.push_back(is_known ? Quantile(errors, 0.16) : kUnknown);
  destination.high.push_back(is_known ? Quantile(errors, 0.84) : kUnknown);
}

/// Appends the average NEES at one timestamp. Appends NaN if there are fewer than two runs. `nees`
/// and `dof` are sums over the runs.
void AppendNees(double nees, double dof, std::int64_t runs, OverTime::AverageNees& destination) {
  const bool is_known = runs > 1;
  const Interval bounds = is_known ? ConsistencyBounds(dof, 1.0) : Interval{kUnknown, kUnknown};
  const double mean = is_known ? nees / dof : kUnknown;
  destination.mean.push_back(mean);
  destination.low.push_back(bounds.low);
  destination.high.push_back(bounds.high);
  if (!is_known) return;
  ++destination.timestamps;
  destination.inside += mean >= bounds.low && mean <= bounds.high ? 1.0 : 0.0;
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

OverTime ComputeOverTime(const std::vector<const ErrorSeries*>& runs) {
  std::map<Timestamp, TimestampStatistics> by_timestamp;
  for (const ErrorSeries* const run : runs) AddRun(*run, by_timestamp);
  OverTime over_time;
  if (runs.empty()) return over_time;
  const ErrorSeries& first = *runs.front();
  for (auto& [timestamp, statistics] : by_timestamp) {
    if (statistics.count < 2) continue;
    over_time.timestamps.push_back(timestamp);
    for (std::size_t i = 0; i < first.blocks.size(); ++i) {
      OverTime::Error& error = over_time.errors[first.blocks[i]];
      error.is_angle = first.angles[i];
      AppendError(statistics.errors[i], error);
      if (statistics.bound_count == statistics.count) {
        error.bound.push_back(
            std::sqrt(statistics.bounds[i] / static_cast<double>(statistics.count)));
      }
    }
    for (std::size_t i = 0; i < first.owners.size(); ++i) {
      AppendNees(statistics.nees[i], statistics.dofs[i], statistics.runs[i],
                 over_time.nees[first.owners[i]]);
    }
  }
  for (auto& [block, error] : over_time.errors) {
    if (error.bound.size() != error.rms.size()) error.bound.clear();
  }
  const auto is_unknown = [](double value) { return std::isnan(value); };
  std::erase_if(over_time.errors, [&](const auto& entry) {
    return std::ranges::all_of(entry.second.rms, is_unknown);
  });
  std::erase_if(over_time.nees, [](const auto& entry) { return entry.second.timestamps == 0; });
  for (auto& [owner, nees] : over_time.nees) nees.inside /= static_cast<double>(nees.timestamps);
  return over_time;
}

}  // namespace alidade
