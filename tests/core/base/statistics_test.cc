// SPDX-License-Identifier: Apache-2.0
#include "alidade/base/statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <iterator>

#include "alidade/base/error.h"
#include "alidade/base/random.h"

namespace alidade {
namespace {

// Compares the bounds with tabulated quantiles of chi-square.
TEST(ConsistencyBounds, AreThoseOfAChiSquareMean) {
  // chi2(0.025; 200) = 162.728 and chi2(0.975; 200) = 241.058 [BarShalom2001, table 1.5.4-1].
  const Interval bounds = ConsistencyBounds(2.0, 100.0);
  EXPECT_NEAR(bounds.low, 162.728 / 200.0, 1e-5);
  EXPECT_NEAR(bounds.high, 241.058 / 200.0, 1e-5);
}

// Each mean is computed from 50 values of chi2(1) that are below the 90 % gate. In 95 % of 4000
// cases the mean must lie within the bounds. The gate reduces the expected mean to 0.62, so the
// upper bound is below 1.
TEST(ConsistencyBounds, KnowWhatAGateCutsOff) {
  const double gate = ChiSquareQuantile(0.9, 1);
  const Interval bounds = ConsistencyBounds(1.0, 50.0, gate);
  Random random(3);
  int inside = 0;
  constexpr int kCases = 4000;
  for (int i = 0; i < kCases; ++i) {
    double sum = 0.0;
    for (int n = 0; n < 50;) {
      const double x = random.Normal();
      if (x * x > gate) continue;
      sum += x * x;
      ++n;
    }
    inside += sum / 50.0 >= bounds.low && sum / 50.0 <= bounds.high;
  }
  // The tolerance is five standard deviations plus 1 %, because the bounds match only two moments
  // of the sum.
  EXPECT_NEAR(inside / double{kCases}, 0.95, 5.0 * std::sqrt(0.95 * 0.05 / kCases) + 0.01);
  EXPECT_LT(bounds.high, 1.0);
}

/// Quantiles at kProbabilities for `dof` degrees of freedom.
struct Quantiles {
  int dof;
  double x[6];
};
constexpr double kProbabilities[] = {1e-9, 0.05, 0.5, 0.95, 0.999, 1.0 - 1e-12};
// These values were computed with 40 digits by mpmath and by Boost.Math. The two programs agree in
// all digits shown here.
constexpr Quantiles kQuantiles[] = {
    {1,
     {1.5707963267948968e-18, 0.0039321400000195232, 0.45493642311957275, 3.8414588206941245,
      10.827566170662731, 50.844171332449173}},
    {2,
     {2.0000000010000001e-9, 0.10258658877510107, 1.3862943611198906, 5.9914645471079802,
      13.815510557964272, 55.262086475786717}},
    {3,
     {2.4179891003585989e-6, 0.35184631774927141, 2.3659738843753383, 7.814727903251178,
      16.266236196238129, 58.919800665904698}},
    {6,
     {0.0036358932000540314, 1.6353828943279067, 5.3481206274471206, 12.591587243743977,
      22.457744484825323, 68.104795298972559}},
    {30,
     {3.6110357866789656, 18.492660981953468, 29.336031516661586, 43.772971825742184,
      59.703064304429928, 120.05209206752403}},
    {100,
     {36.909297937181982, 77.92946516501726, 99.334129235988456, 124.34211340400407,
      149.44925277903871, 233.81064336510848}},
    {1000,
     {754.63306317829334, 927.59436302097905, 999.33341240338097, 1074.679448803441,
      1143.9170926196792, 1347.6202217646366}}};

// The tolerance is seven times the largest observed error, which is 1.1e-15 at one degree of
// freedom.
TEST(ChiSquareQuantile, IsAccurateToRounding) {
  for (const Quantiles& expected : kQuantiles) {
    for (std::size_t i = 0; i < std::size(kProbabilities); ++i) {
      const double x = ChiSquareQuantile(kProbabilities[i], expected.dof);
      EXPECT_NEAR(x / expected.x[i], 1.0, 8e-15) << expected.dof << ' ' << kProbabilities[i];
    }
  }
}

// The median is dof - 2 / 3 + 32 / (405 dof), with an error of at most 0.06 / dof^2 (a known series
// in 1 / dof).
TEST(ChiSquareQuantile, OfManyDegreesOfFreedomIsFound) {
  for (const double dof : {1e4, 1e6, 1e8}) {
    EXPECT_NEAR(ChiSquareQuantile(0.5, dof) / (dof - 2.0 / 3.0 + 32.0 / (405.0 * dof)), 1.0, 1e-12);
  }
}

TEST(ChiSquareQuantile, IsDefinedOnTheUnitInterval) {
  EXPECT_EQ(ChiSquareQuantile(0.0, 2), 0.0);
  EXPECT_TRUE(std::isinf(ChiSquareQuantile(1.0, 2)));
  EXPECT_THROW(ChiSquareQuantile(0.5, 0), ContractViolation);
  EXPECT_THROW(ChiSquareQuantile(1.5, 1), ContractViolation);
}

// The ends p of the interval are those with |f - p| = 1.96 sqrt(p (1 - p) / n).
TEST(ShareInterval, SolvesTheEquationOfWilson) {
  for (const std::int64_t successes : {0, 1, 7, 20}) {
    const double n = 20.0, share = static_cast<double>(successes) / n;
    const Interval interval = ShareInterval(successes, 20);
    for (const double p : {interval.low, interval.high}) {
      EXPECT_NEAR(std::abs(share - p), 1.959964 * std::sqrt(p * (1.0 - p) / n), 1e-6) << successes;
    }
    EXPECT_LE(interval.low, share);
    EXPECT_GE(interval.high, share);
  }
}

}  // namespace
}  // namespace alidade
