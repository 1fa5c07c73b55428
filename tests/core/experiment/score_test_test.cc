// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/score_test.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "alidade/estimation/ekf.h"
#include "support/systems.h"

namespace alidade {
namespace {

// A constant x with the prior N(0, p^2) is measured n times: z_k = x + b + N(0, sigma^2). The
// covariance of all measurements is sigma^2 I + p^2 1 1', so the likelihood is known in closed
// form.
constexpr double kSigma = 0.5, kPriorSigma = 2.0, kStep = 1e-4;

using Data = std::vector<double>;

Data Measurements(int n, double sigma, unsigned seed) {
  std::mt19937 random(seed);
  const double x = kPriorSigma * std::normal_distribution<>()(random);
  Data data;
  for (int k = 0; k < n; ++k) data.push_back(x + sigma * std::normal_distribution<>()(random));
  return data;
}

/// Returns the innovations of a filter that assumes sigma and b.
InnovationRows RunFilter(const Data& data, double sigma, double b = 0.0, double gate = 1.0) {
  Problem problem;
  testing::AddMotion(problem, "p", testing::ConstantMotion(1), {{"x0", 0.0, kPriorSigma}});
  testing::AddSensor(problem, "z", testing::LinearSensor(1.0, sigma), {"p.x0"});
  EkfOptions options;
  options.gate = gate;
  options.rejection_recovery = RejectionRecovery::kNone;
  Ekf filter(problem, options, testing::StreamsOf(problem));
  InnovationRows rows;
  for (std::size_t k = 0; k < data.size(); ++k) {
    const Frame frame = testing::FrameAt(0.1 * static_cast<double>(k), {{0, data[k] - b}});
    for (const MeasurementReport& m : filter.Process(frame).measurements()) rows.Add(m, true);
  }
  return rows;
}

std::optional<Score> ScoreOfSigma(const Data& data, double sigma, double gate = 1.0) {
  const auto run = [&](double step) { return RunFilter(data, sigma * std::exp(step), 0.0, gate); };
  return ComputeScore(run(0.0), run(-kStep), run(kStep), kStep, gate);
}

TEST(ScoreTest, TheGradientOfALogarithmOfSigmaIsThatOfTheLikelihood) {
  constexpr int kCount = 40;
  const Data data = Measurements(kCount, kSigma, 1);
  const double r = kSigma * kSigma, s = r + kCount * kPriorSigma * kPriorSigma;
  const double sum = std::accumulate(data.begin(), data.end(), 0.0), mean = sum / kCount;
  double within = 0.0;
  for (const double z : data) within += (z - mean) * (z - mean);
  const double gradient = kCount - 1 + r / s - within / r - r * kCount * mean * mean / (s * s);
  const auto score = ScoreOfSigma(data, kSigma);
  ASSERT_TRUE(score);
  EXPECT_NEAR(score->gradient, gradient, 1e-5);  // second-order error of the difference
}

TEST(ScoreTest, TheScoreOfABiasIsThatOfTheLikelihood) {
  constexpr int kCount = 25;
  constexpr double kBias = 0.3;
  const Data data = Measurements(kCount, kSigma, 2);
  const double s = kSigma * kSigma + kCount * kPriorSigma * kPriorSigma;
  const double sum = std::accumulate(data.begin(), data.end(), 0.0);
  const auto score =
      ComputeScore(RunFilter(data, kSigma, kBias), RunFilter(data, kSigma, kBias - kStep),
                   RunFilter(data, kSigma, kBias + kStep), kStep);
  ASSERT_TRUE(score);
  // The innovations are linear in b, so the differences are exact.
  EXPECT_NEAR(score->gradient, -(sum - kCount * kBias) / s, 1e-8);
  EXPECT_NEAR(score->information, kCount / s, 1e-8);
  EXPECT_NEAR(score->step(), sum / kCount - kBias, 1e-6);
  EXPECT_NEAR(score->z(), (sum - kCount * kBias) / std::sqrt(kCount * s), 1e-6);
}

TEST(ScoreTest, TheInformationOfSigmaIsThatOfTheLikelihood) {
  constexpr int kCount = 40, kSeeds = 100;
  const double r = kSigma * kSigma, s = r + kCount * kPriorSigma * kPriorSigma;
  double information = 0.0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    information += ScoreOfSigma(Measurements(kCount, kSigma, seed), kSigma)->information / kSeeds;
  }
  EXPECT_NEAR(information, 2.0 * (kCount - 1 + r * r / (s * s)), 0.5);
}

TEST(ScoreTest, IsStandardNormalForAConsistentFilter) {
  constexpr int kSeeds = 400;
  double sum = 0.0, squares = 0.0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const double z = ScoreOfSigma(Measurements(100, kSigma, seed), kSigma)->z();
    sum += z;
    squares += z * z;
  }
  EXPECT_NEAR(sum / kSeeds, 0.0, 4.0 / std::sqrt(kSeeds));
  EXPECT_NEAR(squares / kSeeds, 1.0, 4.0 * std::sqrt(2.0 / kSeeds));
}

TEST(ScoreTest, FindsASigmaThatIsTooSmall) {
  const auto score = ScoreOfSigma(Measurements(400, 1.5 * kSigma, 3), kSigma);
  ASSERT_TRUE(score);
  EXPECT_GT(score->z(), 10.0);
  // Scoring step of sigma^2; the standard deviation of the estimate is 1.5 / sqrt(800).
  EXPECT_NEAR(std::sqrt(1.0 + 2.0 * score->step()), 1.5, 4.0 * 1.5 / std::sqrt(800.0));
}

TEST(ScoreTest, AGateDoesNotBiasTheScore) {
  constexpr double kGate = 0.9;
  const Data data = Measurements(4000, kSigma, 4);
  const auto score = ScoreOfSigma(data, kSigma, kGate);
  // The edge of the gate moves with sigma, but only few measurements change sides.
  ASSERT_TRUE(score);
  EXPECT_LT(std::abs(score->z()), 4.0);
  const auto run = [&](double step) {
    return RunFilter(data, kSigma * std::exp(step), 0.0, kGate);
  };
  EXPECT_LT(ComputeScore(run(0.0), run(-kStep), run(kStep), kStep)->z(), -10.0)
      << "without the correction for the gate";
}

TEST(ScoreTest, RequiresThatTheRunsAcceptTheSameMeasurements) {
  Data data = Measurements(100, kSigma, 5);
  const InnovationRows all = RunFilter(data, kSigma), wider = RunFilter(data, kSigma * 1.001);
  EXPECT_TRUE(ComputeScore(all, all, wider, kStep));
  EXPECT_FALSE(ComputeScore(all, RunFilter(data, kSigma, 0.0, 0.9), wider, kStep));
  data.pop_back();
  EXPECT_FALSE(ComputeScore(all, RunFilter(data, kSigma), wider, kStep));
}

TEST(ScoreTest, RequiresThatTheInnovationsDependOnTheParameter) {
  const InnovationRows rows = RunFilter(Measurements(100, kSigma, 6), kSigma);
  EXPECT_FALSE(ComputeScore(rows, rows, rows, kStep));
}

TEST(ScoreTest, ParametersWithTheSameEffectAreCorrelated) {
  const Data data = Measurements(100, kSigma, 7);
  const InnovationRows center = RunFilter(data, kSigma), low = RunFilter(data, kSigma, -kStep),
                       high = RunFilter(data, kSigma, kStep);
  const auto bias = ComputeScore(center, low, high, kStep),
             opposite = ComputeScore(center, high, low, kStep), sigma = ScoreOfSigma(data, kSigma);
  ASSERT_TRUE(bias && opposite && sigma);
  EXPECT_NEAR(Correlation(*bias, *bias), 1.0, 1e-12);
  EXPECT_NEAR(Correlation(*bias, *opposite), -1.0, 1e-12);
  EXPECT_LT(std::abs(Correlation(*bias, *sigma)), 0.1);
}

TEST(ScoreTest, OmitsMeasurementsThatAreNotScored) {
  MeasurementReport report(0, Outcome::kAccepted, -1, 1);
  const double r = 0.5, s = 1.0;
  report.innovation = Numbers(&r, 1);
  report.s = Numbers(&s, 1);
  InnovationRows rows;
  rows.Add(report, true);
  rows.Add(report, false);
  report.outcome = Outcome::kGated;
  rows.Add(report, true);
  ASSERT_EQ(rows.rows().size(), 3u);
  EXPECT_EQ(rows.rows()[0].dof, 1);
  EXPECT_EQ(rows.rows()[1].dof, 0);
  EXPECT_EQ(rows.rows()[2].dof, 0);
}

}  // namespace
}  // namespace alidade
