// SPDX-License-Identifier: Apache-2.0
#include "alidade/diagnosis/time_series.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "alidade/base/random.h"

namespace alidade {
namespace {

constexpr double kPi = std::numbers::pi;

// The squares of x' = a x + sqrt(1 - a^2) w have rho(k) = a^(2 k) and tau = (1 + a^2) / (1 - a^2).
TEST(AutocorrelationTime, IsThatOfAFirstOrderProcess) {
  for (const double a : {0.0, 0.7, 0.95}) {
    Random random(5);
    double x = random.Normal();
    std::vector<double> squares;
    for (int i = 0; i < 100'000; ++i) {
      squares.push_back(x * x);
      x = a * x + std::sqrt(1.0 - a * a) * random.Normal();
    }
    const double tau = (1.0 + a * a) / (1.0 - a * a);
    EXPECT_NEAR(AutocorrelationTime(squares, 1.0) / tau, 1.0, 0.15) << a;
  }
}

TEST(AutocorrelationTime, IsFromOneToTheLength) {
  EXPECT_EQ(AutocorrelationTime({}, 1.0), 1.0);
  EXPECT_EQ(AutocorrelationTime({1.0, 1.0}, 1.0), 1.0);
  // A constant series is far from the expected mean, so rho(k) = (n - k) / n. The sum over all
  // pairs gives tau = n.
  EXPECT_NEAR(AutocorrelationTime(std::vector<double>(100, 58.0), 1.0), 100.0, 1e-9);
}

TEST(Lag, FindsTheShiftOfASineToAHundredthOfASample) {
  // The series has two periods of 75.76 samples, as in [Ekf2017]. Scale and offset have no effect.
  const double rate = 2.0 * kPi * 0.4 * 0.033;
  for (const double shift : {0.0, 0.3, -0.45, 0.5, 3.7, -6.25, 11.2}) {
    std::vector<double> reference, signal;
    for (int i = 0; i < 152; ++i) {
      reference.push_back(0.3 + 0.1 * std::sin(rate * i));
      signal.push_back(-2.0 + 0.07 * std::sin(rate * (i - shift)));
    }
    EXPECT_NEAR(Lag(signal, reference, 1.0), shift, 0.01) << shift;
    EXPECT_NEAR(Lag(signal, reference, 33.0), 33.0 * shift, 0.33) << shift;
  }
}

/// Returns f(i - shift) for i = 0 .. n - 1.
template <class Function>
std::vector<double> Sampled(int n, double shift, const Function& f) {
  std::vector<double> values;
  for (int i = 0; i < n; ++i) values.push_back(f(i - shift));
  return values;
}

TEST(Lag, FindsTheShiftOfARamp) {
  const auto straight = [](double i) { return 50.0 - 0.8 * i; };
  const auto bent = [](double i) { return 50.0 - 0.8 * i + 0.002 * i * i; };
  for (const double shift : {0.0, 0.3, -3.6, 11.2}) {
    // The lag of a straight line is exact, because the mean square is a parabola in the shift.
    EXPECT_NEAR(Lag(Sampled(100, shift, straight), Sampled(100, 0.0, straight), 1.0), shift, 1e-9);
    EXPECT_NEAR(Lag(Sampled(100, shift, bent), Sampled(100, 0.0, bent), 1.0), shift, 0.02);
  }
  // Noise of sigma 0.3 is added to a slope of 0.8 per sample. Over 100 samples, the mean of the
  // noise shifts the lag by 0.3 / sqrt(100) / 0.8 samples.
  Random random(1);
  const auto noisy = [&](double i) { return straight(i) + 0.3 * random.Normal(); };
  EXPECT_NEAR(Lag(Sampled(100, 2.5, noisy), Sampled(100, 0.0, straight), 1.0), 2.5, 0.15);
}

TEST(Lag, OfARampTakesAnOffsetForDelay) {
  const auto ramp = [](double i) { return 0.5 * i; };
  const auto low = [&](double i) {
    return ramp(i) - 1.0;
  };  // a step of 1 at a slope of 0.5 per sample is a lag of 2 samples
  EXPECT_NEAR(Lag(Sampled(60, 3.0, low), Sampled(60, 0.0, ramp), 1.0), 5.0, 1e-9);
}

TEST(Lag, IsUnknownAtTheEdgeOfTheSearch) {
  // The search range is a quarter of the 80 samples.
  const auto ramp = [](double i) { return 0.5 * i; };
  const auto pulse = [](double i) { return std::exp(-0.02 * (i - 25.0) * (i - 25.0)); };
  EXPECT_NEAR(Lag(Sampled(80, 19.0, ramp), Sampled(80, 0.0, ramp), 1.0), 19.0, 1e-9);
  EXPECT_TRUE(std::isnan(Lag(Sampled(80, 20.0, ramp), Sampled(80, 0.0, ramp), 1.0)));
  EXPECT_TRUE(std::isnan(Lag(Sampled(80, -31.0, ramp), Sampled(80, 0.0, ramp), 1.0)));
  EXPECT_NEAR(Lag(Sampled(80, 12.0, pulse), Sampled(80, 0.0, pulse), 1.0), 12.0, 0.1);
  EXPECT_TRUE(std::isnan(Lag(Sampled(80, 25.0, pulse), Sampled(80, 0.0, pulse), 1.0)));
}

TEST(Lag, IsUnknownWithoutAnythingToMatch) {
  const std::vector<double> constant(50, 0.1), few = {1.0, 2.0, 1.0};
  std::vector<double> wave, broken;
  for (int i = 0; i < 50; ++i) wave.push_back(std::sin(0.3 * i));
  broken = wave;
  broken[7] = std::nan("");
  EXPECT_TRUE(std::isnan(Lag(wave, constant, 1.0)));
  EXPECT_TRUE(std::isnan(Lag(constant, wave, 1.0)));
  EXPECT_TRUE(std::isnan(Lag(broken, wave, 1.0)));
  EXPECT_TRUE(std::isnan(Lag(few, few, 1.0)));
}

// The series is 3, 3, 1.5, and then 1. The centred RMS of this series is:
// value 4  sqrt((9 + 9 + 2.25 + 4) / 7) = 1.86
// value 5  sqrt((18 + 2.25 + 6) / 9) = 1.71
// value 6  sqrt((9 + 2.25 + 7) / 9) = 1.42
// value 7  sqrt((2.25 + 8) / 9) = 1.07, which is the first within 20 % of 1
TEST(Settling, CountsUntilTheCentredRmsStaysInTheBand) {
  std::vector<double> rms(60, 1.0);
  rms[0] = rms[1] = 3.0;
  rms[2] = 1.5;
  EXPECT_EQ(SettlingOf(rms).level, 1.0);
  EXPECT_EQ(SettlingOf(rms).count, 7.0);
  for (double& value : rms) value *= 1e-6;
  EXPECT_EQ(SettlingOf(rms).count, 7.0);
  rms[30] = 3e-6;  // the median stays the same; up to value 35 the RMS is sqrt((9 + 8) / 9) = 1.37
  EXPECT_EQ(SettlingOf(rms).count, 36.0);
}

// Only the first value is a peak. The centred RMS is 1.4, then sqrt((1.96 + 2) / 3) = 1.15, and so
// on. So the series has settled from the second value on. A series without a peak has settled from
// its first value on.
TEST(Settling, ResolvesSingleValues) {
  std::vector<double> rms(60, 1.0);
  EXPECT_EQ(SettlingOf(rms).count, 1.0);
  rms[0] = 1.4;
  EXPECT_EQ(SettlingOf(rms).count, 2.0);
  rms[1] = 1.4;  // RMS sqrt((2 * 1.96 + 1) / 3) = 1.28, sqrt((2 * 1.96 + 3) / 5) = 1.18
  EXPECT_EQ(SettlingOf(rms).count, 3.0);
  EXPECT_EQ(SettlingOf(std::vector<double>(40, 0.0)).count, 1.0);
}

TEST(Settling, IsInfiniteWhereTheEndIsOffTheLevel) {
  std::vector<double> rms(60, 1.0);
  rms.back() = 3.0;
  EXPECT_TRUE(std::isinf(SettlingOf(rms).count));
  EXPECT_TRUE(std::isnan(SettlingOf(std::vector<double>(39, 1.0)).count));
}

}  // namespace
}  // namespace alidade
