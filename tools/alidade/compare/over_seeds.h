// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "alidade/base/statistics.h"
#include "alidade/base/timestamp.h"

/// What runs of several seeds tell together (docs/compare.md).
namespace alidade {

/// An error and that of the reference, means over the same runs; of one run the two themselves.
struct Ratio {
  double error = 0.0, reference_error = 0.0;
  std::int64_t runs = 1;
  /// Where the ratio lies with probability 0.95, by a paired bootstrap over the runs; none where
  /// there is one run alone.
  std::optional<Interval> interval = {};

  double value() const { return error / reference_error; }
  /// Whether the interval includes 1: the runs do not show which of the two is better.
  bool undecided() const { return interval && interval->low <= 1.0 && interval->high >= 1.0; }
};

/// The ratio of means of ratios of one run each, at least one, with its interval
///
///   [q(0.025), q(0.975)] of mean(e_i) / mean(r_i),   i drawn n times of 1 .. n with replacement
///
/// e error, r that of the reference in the same run [Efron1993, ch. 13]: what makes a run hard for
/// both cancels. The same for the same runs in the same order. Of few runs, below some 20, it is
/// too narrow, by about sqrt((n - 1) / n) and more where errors are skewed.
Ratio RatioOfMeans(const std::vector<Ratio>& runs);

/// The mean of values of one run each, at least one, with its interval likewise.
Interval IntervalOfMean(const std::vector<double>& values);

/// Errors of one estimator in one run, timestamp by timestamp.
struct ErrorSeries {
  std::vector<std::string> blocks, owners;  ///< those with truth
  std::vector<bool> angles;                 ///< blocks with errors in rad
  std::vector<Timestamp> timestamps;
  std::vector<double> squares;  ///< |e|^2, by timestamp and block; NaN where there is none
  std::vector<double> nees;     ///< e' C^-1 e, by timestamp and owner; NaN where there is none
  std::vector<double> dofs;     ///< of that
  /// tr P of the Cramer-Rao bound, by timestamp and block; empty: there is none.
  std::vector<double> bounds = {};
  /// mean |e|^2 / tr P of a run, over all its timestamps, by block.
  std::map<std::string, double> by_bound = {};
  std::string no_bound = {};  ///< why there is no bound
};

/// Errors of one estimator over N runs, timestamp by timestamp. N may differ from one to the other,
/// and is at least two.
struct OverTime {
  /// Of a block.
  struct Error {
    std::vector<double> rms;        ///< sqrt(mean |e|^2) over the runs
    std::vector<double> low, high;  ///< 16 and 84 % quantiles of |e|
    std::vector<double> bound;      ///< sqrt(mean tr P) of the Cramer-Rao bound; empty: none
    bool is_angle = false;          ///< in rad
  };
  /// Of an owner: the average NEES [BarShalom2001, sec. 5.4.2]. Of a consistent filter
  ///
  ///   sum of e' C^-1 e over the runs ~ chi2(sum of n),   n = dof of a run
  ///
  /// and all three are divided by sum of n, so that 1 is right whatever n is.
  struct AverageNees {
    std::vector<double> mean;       ///< sum of e' C^-1 e / sum of n
    std::vector<double> low, high;  ///< its bounds of probability 0.95, chi2(N n) / (N n)
    std::int64_t timestamps = 0;    ///< with a NEES
    double inside = 0.0;            ///< share of them at which it is within the bounds
  };

  std::vector<Timestamp> timestamps;
  std::map<std::string, Error> errors;      ///< by block; NaN where there is none
  std::map<std::string, AverageNees> nees;  ///< by owner; NaN where there is none
};

/// Of runs with the same blocks; those timestamps that at least two of them have.
OverTime OverRuns(const std::vector<const ErrorSeries*>& runs);

}  // namespace alidade
