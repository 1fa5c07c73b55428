// SPDX-License-Identifier: Apache-2.0
#include "alidade/diagnosis/diagnosis.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "alidade/base/statistics.h"
#include "alidade/diagnosis/diagnosis_rules.h"

namespace alidade {
namespace {

/// Measurement of a synthetic series.
struct Sample {
  double time_s = 0.0;
  std::vector<double> h = {}, s = {}, u = {};  ///< prediction, sqrt(S_kk) and r_k / sqrt(S_kk)
  Outcome outcome = Outcome::kAccepted;
};

/// Changes sample i of a series. `random` is a source of random numbers.
using Change = std::function<void(Sample& sample, int i, std::mt19937& random)>;

double Normal(std::mt19937& random) { return std::normal_distribution<>()(random); }

/// Returns a series of a sensor named `range`, whose elements have the unit m. The innovations are
/// white and have the predicted size; `change` then changes each sample.
InnovationSeries MakeSeries(int dof, int size, const Change& change, unsigned seed = 1) {
  InnovationSeries series;
  series.sensor = "range";
  series.dof = series.ambient = dof;
  std::mt19937 random(seed);
  for (int k = 0; k < dof; ++k) {
    series.units.emplace_back("m");
    series.z_index.push_back(k);
    series.is_angle.push_back(0);
  }
  const auto m = static_cast<std::size_t>(dof);
  for (int i = 0; i < size; ++i) {
    Sample sample{.time_s = 0.1 * i};
    for (int k = 0; k < dof; ++k) {
      sample.h.push_back(20.0 + 5.0 * k + 4.0 * std::sin(0.1 * i + k));
      sample.s.push_back(0.5);
      sample.u.push_back(Normal(random));
    }
    if (change) change(sample, i, random);
    MeasurementReport report(0, sample.outcome, -1, dof);
    std::vector<double> z = sample.h, r(m), s(m * m, 0.0);
    for (std::size_t k = 0; k < m; ++k) {
      r[k] = sample.u[k] * sample.s[k];
      z[k] += r[k];
      s[k * (m + 1)] = sample.s[k] * sample.s[k];
      report.nis += sample.u[k] * sample.u[k];
    }
    report.z = Numbers(z.data(), m);
    report.h = Numbers(sample.h.data(), m);
    report.innovation = Numbers(r.data(), m);
    report.s = Numbers(s.data(), m * m);
    series.Add(TimestampFromSeconds(sample.time_s), report);
  }
  return series;
}

std::vector<Finding> DiagnoseOne(const InnovationSeries& series) {
  return Diagnose(std::span(&series, 1));
}

/// Returns the finding of this kind. Fails if there is none.
Finding FindingOf(const InnovationSeries& series, FindingKind kind) {
  std::string found;
  for (const Finding& finding : DiagnoseOne(series)) {
    if (finding.kind == kind) return finding;
    found += finding.text + '\n';
  }
  ADD_FAILURE() << "no finding " << ToString(kind) << "; found:\n" << found;
  return {};
}

bool Has(const InnovationSeries& series, FindingKind kind) {
  const std::vector<Finding> findings = DiagnoseOne(series);
  return std::ranges::find(findings, kind, &Finding::kind) != findings.end();
}

bool Contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

void Scale(Sample& sample, double factor) {
  for (double& u : sample.u) u *= factor;
}

/// Replaces z = h + s u without a change of h and s.
void SetMeasurement(Sample& sample, std::size_t k, double z) {
  sample.u[k] = (z - sample.h[k]) / sample.s[k];
}

TEST(Diagnose, FindsNothingInWhiteInnovations) {
  for (const int dof : {1, 2, 3}) {
    for (unsigned seed = 1; seed <= 200; ++seed) {
      const InnovationSeries series = MakeSeries(dof, 150, {}, seed);
      for (const Finding& finding : DiagnoseOne(series)) ADD_FAILURE() << finding.text;
    }
  }
}

TEST(Diagnose, FindsNothingInInnovationsThatAGateTruncates) {
  const double threshold = ChiSquareQuantile(0.9, 2);
  for (unsigned seed = 1; seed <= 50; ++seed) {
    const InnovationSeries series = MakeSeries(
        2, 400,
        [&](Sample& sample, int, std::mt19937& random) {
          // Redraws half of the rejected samples, so that 5 % remain rejected.
          const auto nis = [&] { return sample.u[0] * sample.u[0] + sample.u[1] * sample.u[1]; };
          if (nis() > threshold && random() % 2 == 0) {
            while (nis() > threshold) sample.u = {Normal(random), Normal(random)};
          }
          if (nis() > threshold) sample.outcome = Outcome::kGated;
        },
        seed);
    for (const Finding& finding : DiagnoseOne(series)) ADD_FAILURE() << finding.text;
  }
}

TEST(Diagnose, ReportsTheFactorOfInnovationsThatAreTooLarge) {
  const InnovationSeries series =
      MakeSeries(1, 200, [](Sample& s, int, std::mt19937&) { Scale(s, 1.8); });
  const Finding finding = FindingOf(series, FindingKind::kOverconfident);
  EXPECT_EQ(finding.sensor, "range");
  EXPECT_NEAR(finding.statistic, 1.8, 0.2);
  EXPECT_TRUE(Contains(finding.text, "range: innovations are 1.")) << finding.text;
  EXPECT_FALSE(Has(series, FindingKind::kUnderconfident));
}

TEST(Diagnose, MentionsAnotherCauseForLandmarksWithAPriorOfTheirDistance) {
  InnovationSeries series =
      MakeSeries(1, 200, [](Sample& s, int, std::mt19937&) { Scale(s, 1.8); });
  const std::string remedy = "landmarks.prior.min_observations";
  EXPECT_FALSE(Contains(FindingOf(series, FindingKind::kOverconfident).text, remedy));
  series.has_landmark_prior = true;
  EXPECT_TRUE(Contains(FindingOf(series, FindingKind::kOverconfident).text, remedy));
}

TEST(Diagnose, ReportsTheFactorOfInnovationsThatAreTooSmall) {
  const InnovationSeries series =
      MakeSeries(3, 200, [](Sample& s, int, std::mt19937&) { Scale(s, 0.5); });
  EXPECT_NEAR(FindingOf(series, FindingKind::kUnderconfident).statistic, 0.5, 0.05);
}

TEST(Diagnose, DoesNotTestTheScaleAndTheTailsOfASensorWithARobustLoss) {
  InnovationSeries series = MakeSeries(
      1, 200, [](Sample& s, int i, std::mt19937&) { Scale(s, i % 10 == 5 ? 30.0 : 1.8); });
  EXPECT_TRUE(Has(series, FindingKind::kHeavyTails));
  EXPECT_TRUE(Has(series, FindingKind::kOverconfident));
  series.has_robust_loss = true;
  EXPECT_FALSE(Has(series, FindingKind::kHeavyTails));
  EXPECT_FALSE(Has(series, FindingKind::kOverconfident));
}

TEST(Diagnose, CountsTheMeasurementsOfAFrameOnce) {
  // 40 frames of 20 measurements, whose common scale varies from frame to frame. The mean of the
  // 800 values of NIS would be significant if they were independent.
  const auto common = [](Sample& s, int i, std::mt19937&) {
    s.time_s = 0.1 * (i / 20);
    const double factors[] = {0.4, 2.0, 0.5, 1.5};
    Scale(s, factors[i / 20 % 4]);
  };
  EXPECT_FALSE(Has(MakeSeries(1, 800, common), FindingKind::kOverconfident));
}

TEST(Diagnose, FindsOutliers) {
  const InnovationSeries series = MakeSeries(
      2, 300, [](Sample& s, int i, std::mt19937&) { Scale(s, i % 20 == 7 ? 20.0 : 1.0); });
  const Finding finding = FindingOf(series, FindingKind::kHeavyTails);
  EXPECT_NEAR(finding.statistic, 0.05, 0.01);
  // Sigma is right, but a filter that accepts outliers is overconfident.
  EXPECT_TRUE(Contains(FindingOf(series, FindingKind::kOverconfident).text,
                       "some innovations are far too large"));
}

TEST(Diagnose, NamesTheElementWithTheWrongSigma) {
  const InnovationSeries series =
      MakeSeries(3, 200, [](Sample& s, int, std::mt19937&) { s.u[1] *= 3.0; });
  const Finding finding = FindingOf(series, FindingKind::kElement);
  EXPECT_NEAR(finding.statistic, 3.0, 0.4);
  EXPECT_TRUE(Contains(finding.text, "for element 1;")) << finding.text;
  // One factor for all elements would be wrong.
  EXPECT_FALSE(
      Contains(FindingOf(series, FindingKind::kOverconfident).text, "multiply sigma by about"));
}

TEST(Diagnose, FindsABias) {
  const InnovationSeries series =
      MakeSeries(2, 200, [](Sample& s, int, std::mt19937&) { s.u[1] += 0.6; });
  const Finding finding = FindingOf(series, FindingKind::kBias);
  EXPECT_TRUE(Contains(finding.text, "element 1: the mean innovation is 0.")) << finding.text;
  EXPECT_FALSE(Has(series, FindingKind::kTimeOffset));
}

TEST(Diagnose, DistinguishesPositiveAndNegativeCorrelation) {
  for (const double rho : {0.5, -0.5}) {
    double previous = 0.0;
    const InnovationSeries series = MakeSeries(1, 300, [&](Sample& s, int, std::mt19937&) {
      previous = s.u[0] = rho * previous + std::sqrt(1.0 - rho * rho) * s.u[0];
    });
    EXPECT_EQ(Has(series, FindingKind::kCorrelated), rho > 0.0);
    EXPECT_EQ(Has(series, FindingKind::kAnticorrelated), rho < 0.0);
  }
}

TEST(Diagnose, EstimatesTheTimeOffset) {
  // h = 20 + 4 sin(w t), w = 1/s, is measured 0.2 s late, and the noise is 0.1 m. The rate is a
  // backward difference over 0.1 s.
  const InnovationSeries series = MakeSeries(1, 300, [](Sample& s, int i, std::mt19937&) {
    s.s[0] = 0.1;
    s.h[0] = 20.0 + 4.0 * std::sin(0.1 * i);
    s.u[0] += 0.2 * 4.0 * std::cos(0.1 * i - 0.05) / s.s[0];
  });
  const Finding finding = FindingOf(series, FindingKind::kTimeOffset);
  const std::string begin = "made ";
  const std::size_t number = finding.text.find(begin) + begin.size();
  EXPECT_NEAR(std::stod(finding.text.substr(number)), 200.0, 10.0) << finding.text;
  EXPECT_TRUE(Contains(finding.text, "ms after their timestamps")) << finding.text;
}

/// Returns the series of a compass that turns at 0.7 rad/s, and whose measurements are 50 ms late.
InnovationSeries LateCompass() {
  InnovationSeries series = MakeSeries(1, 300, [](Sample& s, int i, std::mt19937&) {
    s.s[0] = 0.02;
    s.h[0] = 0.5 * std::sin(0.05 * i) + 0.07 * i;
    s.u[0] += 0.05 * (0.25 * std::cos(0.05 * i) + 0.7) / s.s[0];
  });
  series.units = {"rad"};
  series.is_angle = {1};
  for (double& angle : series.z) angle = Angle::Wrap(angle);
  for (double& angle : series.h) angle = Angle::Wrap(angle);
  return series;
}

TEST(Diagnose, TheRateOfAnAngleHasNoJumps) {
  EXPECT_TRUE(Contains(FindingOf(LateCompass(), FindingKind::kTimeOffset).text,
                       "ms after their timestamps"));
}

TEST(Diagnose, DoesNotTakeAWrappedAngleForAWrongSign) {
  InnovationSeries series = MakeSeries(1, 100, [](Sample& s, int, std::mt19937&) {
    s.s[0] = 0.01;
    s.h[0] = std::numbers::pi - 0.05;
    s.u[0] += 10.0;
  });
  for (double& angle : series.z) angle = Angle::Wrap(angle);
  EXPECT_TRUE(Has(series, FindingKind::kUnit)) << "as a number, z is -h";
  series.is_angle = {1};
  EXPECT_FALSE(Has(series, FindingKind::kUnit));
}

/// Returns a series whose sensor measures h = 20 + 4 sin(t) late by the offset. The sigma is 0.1 m,
/// and the time step is 0.1 s. The rate of h has the standard deviation 4 / sqrt(2) m/s.
InnovationSeries LateSeries(double offset_s, int size) {
  return MakeSeries(1, size, [=](Sample& s, int i, std::mt19937&) {
    s.s[0] = 0.1;
    s.h[0] = 20.0 + 4.0 * std::sin(0.1 * i);
    s.u[0] += offset_s * 4.0 * std::cos(0.1 * i - 0.05) / s.s[0];
  });
}

// Other errors also make innovations proportional to the rate.
TEST(Diagnose, ReportsATimeOffsetUpToThreeTimeSteps) {
  EXPECT_TRUE(Has(LateSeries(0.28, 300), FindingKind::kTimeOffset));
  EXPECT_TRUE(Has(LateSeries(-0.28, 300), FindingKind::kTimeOffset));
  EXPECT_FALSE(Has(LateSeries(0.33, 300), FindingKind::kTimeOffset));
  EXPECT_FALSE(Has(LateSeries(-0.33, 300), FindingKind::kTimeOffset));
}

// An offset of 3 ms changes the innovations by 0.003 * 4 / sqrt(2) / 0.1 = 0.085 sigma, and one of
// 4 ms by 0.113 sigma. The limit is 0.1 sigma. With 20 000 measurements, both are significant:
// 0.085 sqrt(20 000) = 12.
TEST(Diagnose, IgnoresATimeOffsetThatIsSignificantButSmall) {
  EXPECT_FALSE(Has(LateSeries(0.003, 20'000), FindingKind::kTimeOffset));
  EXPECT_TRUE(Has(LateSeries(0.004, 20'000), FindingKind::kTimeOffset));
}

TEST(Diagnose, FindsNoiseThatDependsOnTheMeasuredQuantity) {
  const InnovationSeries series = MakeSeries(
      1, 400, [](Sample& s, int, std::mt19937&) { Scale(s, std::pow(s.h[0] / 20.0, 3.0)); });
  const Finding finding = FindingOf(series, FindingKind::kHeteroscedastic);
  EXPECT_GT(finding.statistic, 0.0) << "the noise grows with the measured quantity";
}

TEST(Diagnose, FindsAPriorThatIsFarOff) {
  const InnovationSeries series =
      MakeSeries(1, 100, [](Sample& s, int i, std::mt19937&) { s.u[0] += i == 0 ? 40.0 : 0.0; });
  const Finding finding = FindingOf(series, FindingKind::kPriorFar);
  EXPECT_NEAR(std::sqrt(finding.statistic), 40.0, 4.0);
  EXPECT_EQ(DiagnoseOne(series).front().kind, FindingKind::kPriorFar) << "it explains the others";
}

// A rejected measurement does not change the state, so a prior that is far off rejects the next one
// too.
TEST(Diagnose, DoesNotTakeAFirstOutlierForAPriorThatIsFarOff) {
  const auto series_of = [](int rejected) {
    return MakeSeries(1, 100, [=](Sample& s, int i, std::mt19937&) {
      if (i >= rejected) return;
      s.u[0] += 40.0;
      s.outcome = Outcome::kGated;
    });
  };
  EXPECT_FALSE(Has(series_of(1), FindingKind::kPriorFar));
  EXPECT_TRUE(Has(series_of(10), FindingKind::kPriorFar));
}

// The quantile of chi-square for a false alarm of 1e-6 corresponds to 5.1 sigma. The median of NIS
// increases this limit, but at most by the factor 4.
TEST(Diagnose, ReportsThePriorOnlyIfTheFirstInnovationsAreLargerThanTheOthers) {
  const auto series_of = [](double first, double others) {
    return MakeSeries(1, 100, [=](Sample& s, int i, std::mt19937&) {
      if (i < 3) s.u[0] = i == 0 ? first : 0.0;
      if (i >= 3) Scale(s, others);
    });
  };
  EXPECT_TRUE(Has(series_of(8.0, 1.0), FindingKind::kPriorFar));
  EXPECT_FALSE(Has(series_of(8.0, 3.0), FindingKind::kPriorFar));
  EXPECT_TRUE(Has(series_of(25.0, 3.0), FindingKind::kPriorFar));
  EXPECT_TRUE(Has(series_of(25.0, 30.0), FindingKind::kPriorFar)) << "the factor is at most 4";
}

// Later measurements agree with their predictions, because the state has adapted to the first one.
TEST(Diagnose, ComparesTheFirstMeasurementWithThePriorToFindAUnit) {
  const auto first = [](double h, double ratio) {
    return MakeSeries(1, 100, [=](Sample& s, int i, std::mt19937&) {
      if (i > 0) return;
      s.h[0] = h;
      SetMeasurement(s, 0, ratio * h);
    });
  };
  const Finding finding = FindingOf(first(20.0, 1000.0), FindingKind::kUnit);
  EXPECT_TRUE(Contains(finding.text, "the first measurement is 1000 times its prediction"))
      << finding.text;
  EXPECT_FALSE(Has(first(0.1, 1000.0), FindingKind::kUnit)) << "0.2 sigma: the prediction may be 0";
  EXPECT_TRUE(Has(first(0.1, 1000.0), FindingKind::kPriorFar));
  EXPECT_FALSE(Has(first(20.0, 7.0), FindingKind::kUnit)) << "7 is not the factor of a unit";
}

// A large factor may differ by exp(0.35) = 1.42. A small one, such as that between km/h and m/s, is
// also the ratio of two usual values of sigma.
TEST(UnitHint, NamesALargeFactorBetweenTwoUnits) {
  const std::string metres = " (near the factor between mm and m, or between ms and s)";
  EXPECT_EQ(internal::UnitHint(1000.0, ""), metres);
  EXPECT_EQ(internal::UnitHint(1.0 / 720.0, ""), metres);
  EXPECT_EQ(internal::UnitHint(690.0, ""), "");
  EXPECT_EQ(internal::UnitHint(50.0, ""), " (near the factor between degrees and rad)");
  EXPECT_EQ(internal::UnitHint(1e9, ""), " (near the factor between ns and s)");
  EXPECT_EQ(internal::UnitHint(3.6, ""), "");
  EXPECT_EQ(internal::UnitHint(1.0, ""), "");
}

TEST(UnitHint, NamesOnlyFactorsOfTheUnit) {
  EXPECT_EQ(internal::UnitHint(60.0, "rad"), " (near the factor between degrees and rad)");
  EXPECT_EQ(internal::UnitHint(60.0, "s"), " (near the factor between minutes and s)");
  EXPECT_EQ(internal::UnitHint(60.0, "m"), "");
  EXPECT_EQ(internal::UnitHint(90.0, "m"), " (near the factor between cm and m)");
  EXPECT_EQ(internal::UnitHint(60.0, "px"), "");
}

TEST(Diagnose, NamesTheFactorBetweenTwoUnitsOfTheSizeOfInnovations) {
  const std::string hint = " (near the factor between mm and m, or between ms and s)";
  const InnovationSeries all =
      MakeSeries(1, 200, [](Sample& s, int, std::mt19937&) { Scale(s, 1000.0); });
  const std::string large = FindingOf(all, FindingKind::kOverconfident).text;
  EXPECT_TRUE(Contains(large, hint)) << large;
  const InnovationSeries small =
      MakeSeries(1, 200, [](Sample& s, int, std::mt19937&) { Scale(s, 1.0 / 1000.0); });
  EXPECT_TRUE(Contains(FindingOf(small, FindingKind::kUnderconfident).text, hint));
  const InnovationSeries element =
      MakeSeries(2, 200, [](Sample& s, int, std::mt19937&) { s.u[1] /= 1000.0; });
  const std::string text = FindingOf(element, FindingKind::kElement).text;
  EXPECT_TRUE(Contains(text, "for element 1" + hint)) << text;
}

TEST(Diagnose, NamesTheFactorBetweenTwoUnits) {
  const struct {
    double factor;
    const char* name;
  } units[] = {{1000.0, "mm and m"},  {0.001, "mm and m"}, {57.3, "degrees and rad"},
               {3.6, "km/h and m/s"}, {1e9, "ns and s"},   {-1.0, "check the sign"}};
  for (const auto& unit : units) {
    const InnovationSeries series = MakeSeries(1, 100, [&](Sample& s, int, std::mt19937& random) {
      SetMeasurement(s, 0, unit.factor * s.h[0] * (1.0 + 0.005 * Normal(random)));
      s.outcome = Outcome::kGated;
    });
    const Finding finding = FindingOf(series, FindingKind::kUnit);
    EXPECT_TRUE(Contains(finding.text, unit.name)) << finding.text;
    EXPECT_EQ(DiagnoseOne(series).front().kind, FindingKind::kUnit) << "it explains the others";
  }
}

TEST(Diagnose, DoesNotTakeAnArbitraryRatioForAUnit) {
  const InnovationSeries series = MakeSeries(1, 100, [&](Sample& s, int, std::mt19937&) {
    SetMeasurement(s, 0, 7.0 * s.h[0]);
    s.outcome = Outcome::kGated;
  });
  EXPECT_FALSE(Has(series, FindingKind::kUnit));
  EXPECT_TRUE(Has(series, FindingKind::kPriorFar));
}

TEST(Diagnose, FindsDegreesThatAreReadAsMetres) {
  // A drive of 300 m near (48.1, 11.6), with sigma = 2 m.
  const auto drive = [](Sample& s, int i, std::mt19937& random) {
    s.s = {2.0, 2.0};
    s.h = {48.1 + 1e-5 * i, 11.6 + 2e-5 * i};
    for (double& u : s.u) u = 1e-6 * Normal(random);
  };
  InnovationSeries series = MakeSeries(2, 300, drive);
  const Finding finding = FindingOf(series, FindingKind::kUnit);
  EXPECT_TRUE(Contains(finding.text, "degrees read as metres?")) << finding.text;
  series.units = {"rad", "rad"};
  EXPECT_FALSE(Has(series, FindingKind::kUnit));
}

TEST(Diagnose, FindsTimesInMs) {
  const auto far = [](double step_s, bool is_far) {
    return MakeSeries(1, 50, [=](Sample& s, int i, std::mt19937&) {
      s.time_s = step_s * i;
      s.outcome = is_far ? Outcome::kOutOfDomain : Outcome::kAccepted;
    });
  };
  EXPECT_TRUE(Has(far(33.0, true), FindingKind::kTimeUnit));
  EXPECT_FALSE(Has(far(0.033, true), FindingKind::kTimeUnit));
  EXPECT_FALSE(Has(far(33.0, false), FindingKind::kTimeUnit)) << "a slow sensor as predicted";
}

// The rule has no lower limit: the rate of a fast sensor is not known.
TEST(Diagnose, ReportsTheUnitOfTheTimeOnlyIfTheMeanTimeStepIsLongerThanTenSeconds) {
  const auto far = [](double step_s) {
    return MakeSeries(1, 50, [=](Sample& s, int i, std::mt19937&) {
      s.time_s = step_s * i;
      s.outcome = Outcome::kOutOfDomain;
    });
  };
  EXPECT_TRUE(Contains(FindingOf(far(10.1), FindingKind::kTimeUnit).text,
                       "the mean time step is 10.1 s, and the innovations are not as predicted: "
                       "the times may be in ms"));
  EXPECT_FALSE(Has(far(9.9), FindingKind::kTimeUnit));
  EXPECT_FALSE(Has(far(33e-6), FindingKind::kTimeUnit)) << "times in s that were taken for ms";
}

// Each of these changes is another sign of times in ms.
TEST(Diagnose, FindsTimesInMsByTheSizeOfTheInnovationsThePriorOrRejections) {
  const Change changes[] = {
      [](Sample& s, int, std::mt19937&) { Scale(s, 10.0); },
      [](Sample& s, int, std::mt19937&) { Scale(s, 0.1); },
      [](Sample& s, int i, std::mt19937&) { s.u[0] += i == 0 ? 40.0 : 0.0; },
      [](Sample& s, int i, std::mt19937&) {
        if (i % 3 != 0) s.outcome = Outcome::kGated;
      },
  };
  for (const Change& change : changes) {
    const InnovationSeries series = MakeSeries(1, 50, [&](Sample& s, int i, std::mt19937& random) {
      s.time_s = 33.0 * i;
      change(s, i, random);
    });
    EXPECT_TRUE(Has(series, FindingKind::kTimeUnit)) << "change " << &change - changes;
  }
}

TEST(Diagnose, FindsASensorModelThatIsNotDefinedAtTheEstimate) {
  const auto share = [](int defined) {
    return MakeSeries(1, 100, [=](Sample& s, int i, std::mt19937&) {
      if (i >= defined) s.outcome = Outcome::kOutOfDomain;
    });
  };
  EXPECT_NEAR(FindingOf(share(40), FindingKind::kOutOfDomain).statistic, 0.6, 1e-12);
  EXPECT_FALSE(Has(share(60), FindingKind::kOutOfDomain));
}

TEST(Diagnose, FindsRejections) {
  const auto rejected_from = [](int first, int last) {
    return MakeSeries(1, 100, [=](Sample& s, int i, std::mt19937&) {
      if (i < first || i >= last) return;
      Scale(s, 1.0);
      s.u[0] = 9.0;
      s.outcome = Outcome::kGated;
    });
  };
  EXPECT_TRUE(Contains(FindingOf(rejected_from(40, 100), FindingKind::kRejected).text, "60 %"));
  EXPECT_TRUE(Contains(FindingOf(rejected_from(40, 52), FindingKind::kRejected).text,
                       "12 consecutive timestamps"));
  EXPECT_FALSE(Has(rejected_from(40, 44), FindingKind::kRejected));
}

TEST(Diagnose, FindsExchangedElements) {
  const auto exchange = [](Sample& s, int, std::mt19937&) {
    const std::vector<double> z = {s.h[0] + s.s[0] * s.u[0], s.h[1] + s.s[1] * s.u[1]};
    SetMeasurement(s, 0, z[1]);
    SetMeasurement(s, 1, z[0]);
    s.outcome = Outcome::kGated;
  };
  InnovationSeries series = MakeSeries(2, 60, exchange);
  const Finding finding = FindingOf(series, FindingKind::kSwapped);
  EXPECT_TRUE(Contains(finding.text, "elements 0 and 1")) << finding.text;
  series.units = {"m", "rad"};
  EXPECT_FALSE(Has(series, FindingKind::kSwapped)) << "elements with different units";
}

/// Changes the measurements from `first` to before `last` to 20 m. The predictions still vary.
Change Repeated(int first, int last) {
  return [=](Sample& s, int i, std::mt19937&) {
    if (i >= first && i < last) SetMeasurement(s, 0, 20.0);
  };
}

TEST(Diagnose, FindsASensorThatRepeatsAMeasurement) {
  const Finding finding = FindingOf(MakeSeries(1, 100, Repeated(40, 61)), FindingKind::kStuck);
  EXPECT_EQ(finding.statistic, 20.0) << "repetitions of the first of 21 equal measurements";
  EXPECT_TRUE(Contains(finding.text, "the measurement at 4 s was repeated 20 times"))
      << finding.text;
  EXPECT_FALSE(Has(MakeSeries(1, 100, Repeated(40, 60)), FindingKind::kStuck)) << "19 repetitions";
}

// For example, a sensor that measures that the velocity is zero.
TEST(Diagnose, ASensorThatAlwaysMeasuresTheSameIsNotStuck) {
  EXPECT_FALSE(Has(MakeSeries(1, 100, Repeated(0, 100)), FindingKind::kStuck));
  EXPECT_TRUE(Has(MakeSeries(1, 100, Repeated(1, 100)), FindingKind::kStuck));
}

TEST(Diagnose, NamesTheElementThatIsStuck) {
  const Finding finding = FindingOf(MakeSeries(2, 100, Repeated(40, 80)), FindingKind::kStuck);
  EXPECT_TRUE(Contains(finding.text, "element 0 of the measurement at 4 s")) << finding.text;
}

// Measurements of several landmarks alternate, and a landmark may have a constant direction.
TEST(Diagnose, MeasurementsOfLandmarksAreNotStuck) {
  InnovationSeries series = MakeSeries(1, 100, Repeated(40, 80));
  series.landmarks.assign(series.size(), 7);
  EXPECT_FALSE(Has(series, FindingKind::kStuck));
}

TEST(Diagnose, TestsTheNoiseOnlyIfThereAreEnoughFrames) {
  const Change scale = [](Sample& s, int, std::mt19937&) { Scale(s, 3.0); };
  EXPECT_FALSE(Has(MakeSeries(1, kMinDiagnosedFrames - 1, scale, 3), FindingKind::kOverconfident));
  EXPECT_TRUE(Has(MakeSeries(1, kMinDiagnosedFrames, scale, 3), FindingKind::kOverconfident));
}

TEST(Diagnose, OrdersTheFindingsByKind) {
  std::vector<InnovationSeries> sensors = {
      MakeSeries(1, 200, [](Sample& s, int, std::mt19937&) { Scale(s, 2.0); }),
      MakeSeries(2, 200, [](Sample& s, int, std::mt19937&) { s.u[1] += 0.6; })};
  sensors[1].sensor = "beacon";
  const std::vector<Finding> findings = Diagnose(sensors);
  ASSERT_GE(findings.size(), 2u);
  EXPECT_EQ(findings.front().sensor, "beacon");
  EXPECT_TRUE(std::ranges::is_sorted(findings, {}, &Finding::kind));
}

}  // namespace
}  // namespace alidade
