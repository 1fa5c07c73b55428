// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "alidade/base/statistics.h"
#include "alidade/base/timestamp.h"

/// Statistics over the runs of several seeds (docs/compare.md).
namespace alidade {

/// Ratio of a mean error to the mean error of the reference over the same runs. For a single run,
/// `error` and `reference_error` are the errors of that run.
struct Ratio {
  double error = 0.0, reference_error = 0.0;
  std::int64_t runs = 1;
  /// Interval that contains the ratio with probability 0.95. It is computed by a paired bootstrap
  /// over the runs. For a single run, it is nullopt.
  std::optional<Interval> interval = {};

  double value() const { return error / reference_error; }
  /// Returns true if the interval includes 1, that is, if the runs do not show which error is
  /// smaller.
  bool undecided() const { return interval && interval->low <= 1.0 && interval->high >= 1.0; }
};

/// Computes the ratio of mean errors from the ratios of at least one run, and the interval
///
///   [q(0.025), q(0.975)] of mean(e_i) / mean(r_i),   i drawn n times from 1 .. n with replacement
///
/// e is the error and r is the error of the reference in the same run [Efron1993, ch. 13]. The
/// difficulty of a run affects e and r alike and cancels. The same runs in the same order yield the
/// same interval. With fewer than about 20 runs, the interval is too narrow by a factor of about
/// sqrt((n - 1) / n). If the errors are skewed, the interval is even narrower.
Ratio RatioOfMeans(const std::vector<Ratio>& runs);

/// Computes the bootstrap interval of the mean of the values. There is one value for each run.
Interval IntervalOfMean(const std::vector<double>& values);

/// Errors of one estimator in one run at each timestamp.
struct ErrorSeries {
  std::vector<std::string> blocks, owners;  ///< blocks with truth, and their owners
  std::vector<bool> angles;                 ///< for each block: true if errors are in rad
  std::vector<Timestamp> timestamps;
  std::vector<double> squares;  ///< |e|^2, by timestamp and block; NaN if unknown
  std::vector<double> nees;     ///< e' C^-1 e, by timestamp and owner; NaN if unknown
  std::vector<double> dofs;     ///< degrees of freedom of each NEES
  /// tr P of the Cramer-Rao bound, by timestamp and block; empty if there is no bound.
  std::vector<double> bounds = {};
  /// Mean of |e|^2 / tr P over all timestamps of the run, by block.
  std::map<std::string, double> by_bound = {};
  std::string no_bound_reason = {};  ///< reason why there is no bound; "" if there is a bound
};

/// Errors of one estimator at each timestamp, over N runs. N is at least two, and may differ
/// between timestamps.
struct OverTime {
  /// Error of one block at each timestamp.
  struct Error {
    std::vector<double> rms;        ///< sqrt(mean |e|^2) over the runs
    std::vector<double> low, high;  ///< 16 and 84 % quantiles of |e|
    std::vector<double> bound;      ///< sqrt(mean tr P) of the Cramer-Rao bound; empty if unknown
    bool is_angle = false;          ///< true: the unit is rad
  };
  /// Average NEES of one owner [BarShalom2001, sec. 5.4.2]. For a consistent filter
  ///
  ///   sum of e' C^-1 e over the runs ~ chi2(sum of n),   n = dof of a run
  ///
  /// The mean and the bounds are divided by the sum of n, so the expected value is 1 for every n.
  struct AverageNees {
    std::vector<double> mean;       ///< sum of e' C^-1 e / sum of n
    std::vector<double> low, high;  ///< bounds with probability 0.95, chi2(N n) / (N n)
    std::int64_t timestamps = 0;    ///< number of timestamps with a NEES
    double inside = 0.0;            ///< share of these timestamps with the mean in the bounds
  };

  std::vector<Timestamp> timestamps;
  std::map<std::string, Error> errors;      ///< by block; NaN if unknown
  std::map<std::string, AverageNees> nees;  ///< by owner; NaN if unknown
};

/// Computes the statistics of runs with the same blocks. Uses only timestamps that occur in at
/// least two runs.
OverTime ComputeOverTime(const std::vector<const ErrorSeries*>& runs);

}  // namespace alidade
