// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "alidade/bundle/bundle_file.h"
#include "batch_fixture.h"
#include "support/bal_formula.h"
#include "support/bundles.h"

namespace alidade {
namespace {

using testing::Disturb;
using testing::Shipped;
using testing::TrueBundle;
using testing::Wave;

BundleResult Adjusted(BundleProblem& problem, const BundleOptions& options = {}) {
  const SharedSensor sensor = BundleSensor(Shipped(), problem);
  ExcludeUndefined(*sensor, problem);
  return AdjustBundle(*sensor, problem, options);
}

double Distance(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

/// Pixels determine everything except the scale. The results are therefore compared in units of the
/// distance from the first camera to the first point.
TEST(CeresBundle, FindsCamerasPointsAndIntrinsics) {
  const BundleProblem truth = TrueBundle().problem;
  BundleProblem problem = truth;
  Disturb(problem);
  const SharedSensor sensor = BundleSensor(Shipped(), problem);
  EXPECT_GT(BundleRms(*sensor, problem), 1.0) << "the disturbed problem has large residuals";
  const BundleResult result = Adjusted(problem);
  EXPECT_EQ(result.end, BundleEnd::kConverged) << result.message;
  EXPECT_LT(BundleRms(*sensor, problem), 1e-8);
  EXPECT_EQ(problem.cameras[0].position, truth.cameras[0].position)
      << "the first camera is constant";
  EXPECT_EQ(problem.cameras[0].orientation, truth.cameras[0].orientation);
  const auto& eye = truth.cameras[0].position;
  const double scale = Distance(problem.points[0], eye) / Distance(truth.points[0], eye);
  EXPECT_NEAR(scale, 1.0, 0.05);
  const auto expect_near = [&](const std::array<double, 3>& is, const std::array<double, 3>& was) {
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_NEAR((is[i] - eye[i]) / scale, was[i] - eye[i], 1e-7);
  };
  for (std::size_t i = 0; i < truth.points.size(); ++i)
    expect_near(problem.points[i], truth.points[i]);
  for (std::size_t i = 0; i < truth.cameras.size(); ++i) {
    expect_near(problem.cameras[i].position, truth.cameras[i].position);
    double d[3];
    UnitQuaternion::Minus(problem.cameras[i].orientation.data(),
                          truth.cameras[i].orientation.data(), d);
    EXPECT_LT(std::hypot(d[0], d[1], d[2]), 1e-8);
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(problem.intrinsics[i][k], truth.intrinsics[i][k], k == 0 ? 1e-5 : 1e-7);
  }
  // Each of the 6 cameras has 9 unknowns, except the first camera, which has 3. The 40 points have
  // 120 unknowns.
  EXPECT_EQ(result.unknowns, 5 * 9 + 3 + 120);
  EXPECT_EQ(result.rank, result.unknowns - 1);
  const std::vector<std::string> words = DescribeUndetermined(problem, *sensor, result);
  ASSERT_EQ(words.size(), 3u);
  EXPECT_EQ(words[0], "gauge: the pose of the first camera and the scale are constant");
  EXPECT_EQ(words[1].find("extent: "), 0u) << words[1];
  EXPECT_EQ(words[2], "rank: 167 of 168 unknowns: all are determined except the scale");
}

TEST(CeresBundle, LeavesFixedIntrinsicsAsTheyAre) {
  BundleProblem start = TrueBundle().problem;
  Disturb(start);
  for (const bool all : {true, false}) {
    BundleProblem problem = start;
    BundleOptions options;
    options.fixed =
        all ? std::vector<std::string>{"intrinsics"} : std::vector<std::string>{"k1", "k2"};
    const BundleResult result = Adjusted(problem, options);
    EXPECT_EQ(result.end, BundleEnd::kConverged) << result.message;
    EXPECT_EQ(result.unknowns, 5 * 6 + 120 + (all ? 0 : 6));
    for (std::size_t i = 0; i < start.intrinsics.size(); ++i) {
      EXPECT_EQ(problem.intrinsics[i][0] == start.intrinsics[i][0], all);
      EXPECT_EQ(problem.intrinsics[i][1], start.intrinsics[i][1]);
      EXPECT_EQ(problem.intrinsics[i][2], start.intrinsics[i][2]);
    }
  }
  BundleOptions wrong;
  wrong.fixed = {"k11"};
  EXPECT_THROW(Adjusted(start, wrong), Error);
}

TEST(CeresBundle, SharesIntrinsicsBetweenCameras) {
  BundleFile truth = TrueBundle(5, 40);
  BundleProblem& problem = truth.problem;
  const SharedSensor sensor = BundleSensor(Shipped(), problem);
  problem.intrinsics = {{510.0, -0.1, 0.02}};
  for (BundleCamera& camera : problem.cameras) camera.intrinsics = 0;
  for (BundleObservation& seen : problem.observations) {
    ASSERT_EQ(sensor->Predict(RoleValues(RolesOf(*sensor), problem, seen).data(), seen.z.data()),
              Status::kOk);
  }
  Disturb(problem);
  const BundleResult result = Adjusted(problem);
  EXPECT_EQ(result.end, BundleEnd::kConverged) << result.message;
  EXPECT_EQ(result.unknowns, 4 * 6 + 3 + 120);
  EXPECT_NEAR(problem.intrinsics[0][0], 510.0, 1e-5);
  EXPECT_NEAR(problem.intrinsics[0][1], -0.1, 1e-7);
}

TEST(CeresBundle, ALossShrugsOffOutliers) {
  BundleProblem problem = TrueBundle().problem;
  const auto truth = problem.points;
  testing::AddOutliers(problem);
  BundleProblem squared = problem;
  Adjusted(squared);
  BundleOptions options;
  options.loss = {LossKind::kCauchy, 0.5};
  Adjusted(problem, options);
  const auto worst = [&](const BundleProblem& one) {
    const auto& eye = one.cameras[0].position;
    const double scale = Distance(one.points[1], eye) / Distance(truth[1], eye);
    double most = 0.0;
    for (std::size_t i = 0; i < truth.size(); ++i)
      most =
          std::max(most, std::abs(Distance(one.points[i], eye) / scale - Distance(truth[i], eye)));
    return most;
  };
  EXPECT_GT(worst(squared), 0.05);
  EXPECT_LT(worst(problem), 0.01);
}

TEST(CeresBundle, EndsAfterTheIterationWhereItIsTold) {
  BundleProblem problem = TrueBundle().problem;
  Disturb(problem);
  const SharedSensor sensor = BundleSensor(Shipped(), problem);
  const double before = BundleRms(*sensor, problem);
  BundleOptions options;
  int calls = 0;
  options.stop = [&] { return ++calls > 2; };
  const BundleResult result = Adjusted(problem, options);
  EXPECT_EQ(result.end, BundleEnd::kStopped);
  EXPECT_EQ(result.iterations, 2);
  EXPECT_LT(BundleRms(*sensor, problem), 0.5 * before) << "the result of the iterations is kept";
}

// A very distant point makes the norm of all unknowns so large that every step is relatively small.
TEST(CeresBundle, APointFarAwayDoesNotEndIt) {
  double cost[2] = {};
  for (const double far : {1e9, 1e15}) {
    BundleProblem problem = TrueBundle().problem;
    Disturb(problem);
    problem.points[0][0] = far;
    BundleOptions options;
    options.max_iterations = 20;
    const BundleResult result = Adjusted(problem, options);
    EXPECT_GE(result.iterations, 10) << result.message;
    cost[far > 1e9] = result.cost_after;
  }
  EXPECT_NEAR(cost[1] / cost[0], 1.0, 0.1);
}

/// The scale is restored after the solution, by one product and two sums for each coordinate. The
/// restored scale is therefore accurate to a few epsilon.
TEST(CeresBundle, HoldsTheScaleThatPixelsDoNotTell) {
  BundleProblem problem = TrueBundle().problem;
  testing::AddOutliers(problem);
  Disturb(problem);
  const auto extent = [&] {
    std::vector<std::array<double, 3>> positions;
    for (const BundleCamera& camera : problem.cameras) positions.push_back(camera.position);
    return testing::MedianDistance(positions);
  };
  const double before = extent();
  const BundleResult result = Adjusted(problem);
  EXPECT_NEAR(extent() / before, 1.0, 1e-14);
  EXPECT_NEAR(result.extent_before / before, 1.0, 1e-14);
  EXPECT_NEAR(result.extent_after / before, 1.0, 1e-14);
  const SharedSensor sensor = BundleSensor(Shipped(), problem);
  const double rms = BundleRms(*sensor, problem);
  EXPECT_NEAR(0.5 * rms * rms * static_cast<double>(problem.observations.size()), result.cost_after,
              1e-9 * result.cost_after)
      << "no pixel has changed";
}

/// If all cameras are at one place, or if there is only one camera, the points define the scale.
TEST(CeresBundle, HoldsTheScaleOfCamerasAtOnePlace) {
  for (const int cameras : {1, 4}) {
    BundleProblem problem = TrueBundle(cameras, 30).problem;
    for (BundleCamera& camera : problem.cameras) camera.position = {0, 0, 0};
    problem.observations[0].z[0] += 5.0;
    const BundleResult result = Adjusted(problem);
    EXPECT_GT(result.extent_before, 1.0) << "the points are about 6 m away";
    EXPECT_NEAR(result.extent_after / result.extent_before, 1.0, 1e-14);
  }
}

/// Before and after the adjustment, the written file is evaluated with the formula of BAL.
TEST(CeresBundle, ABalCameraSeesPointsBehindIt) {
  BundleFile file = testing::BundleOnBothSides();
  BundleProblem& problem = file.problem;
  Disturb(problem);
  const SharedSensor sensor = BundleSensor(Shipped(), problem);
  EXPECT_EQ(ExcludeUndefined(*sensor, problem), 0);
  const auto formula = [&] {
    std::istringstream text(BundleText(file));
    return testing::BalFormula(text);
  };
  const testing::FormulaCost before = formula();
  EXPECT_EQ(before.observations, std::ssize(problem.observations));
  EXPECT_GT(before.behind, before.observations / 5);
  EXPECT_NEAR(BundleRms(*sensor, problem), before.Rms(), 1e-9 * before.Rms());
  const BundleResult result = AdjustBundle(*sensor, problem, {});
  EXPECT_EQ(result.end, BundleEnd::kConverged) << result.message;
  EXPECT_EQ(result.residuals, 2 * before.observations);
  EXPECT_NEAR(result.cost_before, 0.5 * before.squares, 1e-9 * before.squares);
  const testing::FormulaCost after = formula();
  EXPECT_NEAR(BundleRms(*sensor, problem), after.Rms(), 1e-9 * after.Rms());
  EXPECT_NEAR(result.cost_after, 0.5 * after.squares, 1e-9 * after.squares);
  // Each coordinate of the noise has a mean square of 1/4.
  EXPECT_LT(after.Rms(), std::sqrt(0.5)) << "the unknowns absorb a part of the noise";
}

/// If all residuals r exceed the scale of a loss, the loss is nearly proportional to |r|, and the
/// solver converges slowly. A tolerance of 1e-12 would take over 500 more steps without a
/// noticeable gain.
TEST(CeresBundle, EndsByTheToleranceOfTheCost) {
  BundleFile file = testing::BundleOnBothSides();
  testing::AddOutliers(file.problem);
  Disturb(file.problem);
  BundleOptions options;
  options.loss = {LossKind::kHuber, 1e-3};
  const auto solve = [&](double tolerance) {
    BundleProblem problem = file.problem;
    options.function_tolerance = tolerance;
    return Adjusted(problem, options);
  };
  const BundleResult rough = solve(1e-4), usual = solve(BundleOptions().function_tolerance);
  options.max_iterations = 5000;
  const BundleResult fine = solve(1e-12);
  EXPECT_EQ(usual.end, BundleEnd::kConverged) << usual.message;
  EXPECT_LT(rough.iterations, usual.iterations);
  EXPECT_LT(usual.iterations, fine.iterations);
  EXPECT_NEAR(usual.cost_after / fine.cost_after, 1.0, 1e-4);
}

/// A change of the cost within rounding errors counts as convergence, even if the tolerance is
/// smaller.
TEST(CeresBundle, EndsWhereTheCostChangesByRoundingOnly) {
  BundleProblem problem = testing::BundleOnBothSides().problem;
  Disturb(problem);
  BundleOptions options;
  options.function_tolerance = 0.0;
  const BundleResult result = Adjusted(problem, options);
  EXPECT_EQ(result.end, BundleEnd::kConverged) << result.message;
}

TEST(CeresBundle, RefusesALossOfAScaleThatLeavesNoGradient) {
  BundleProblem problem = TrueBundle(2, 5).problem;
  for (const double scale : {1e-20, 0.0, -1.0, 1e200, std::nan("")}) {
    BundleOptions options;
    options.loss = {LossKind::kHuber, scale};
    try {
      Adjusted(problem, options);
      ADD_FAILURE() << scale;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::kUsage);
      EXPECT_NE(std::string(e.what()).find("out of bounds; expected 0.001 to 1e+06"),
                std::string::npos)
          << e.what();
    }
  }
}

TEST(CeresBundle, LeavesOutWhatIsBehindItsCamera) {
  BundleProblem problem = TrueBundle().problem;
  const auto seen_before = problem.observations.size();
  problem.points.push_back({0.0, 0.0, -50.0});
  problem.observations.push_back({0, static_cast<int>(problem.points.size()) - 1, {3, 4}, true});
  const SharedSensor sensor = BundleSensor(Shipped(), problem);
  EXPECT_EQ(ExcludeUndefined(*sensor, problem), 1);
  const BundleResult result = AdjustBundle(*sensor, problem, {});
  EXPECT_EQ(result.end, BundleEnd::kConverged) << result.message;
  EXPECT_EQ(result.residuals, static_cast<int>(2 * seen_before));
  const std::vector<std::string> words = DescribeUndetermined(problem, *sensor, result);
  EXPECT_EQ(words[2], "1 point is unchanged: not seen by any camera");
}

TEST(CeresBundle, SaysWhatIsNotDetermined) {
  BundleProblem problem = TrueBundle(4, 20).problem;
  // The two halves of the problem have no common observation, and one point is seen only once.
  std::erase_if(problem.observations, [](const BundleObservation& seen) {
    return (seen.camera < 2) != (seen.point < 10) || (seen.camera == 1 && seen.point == 3);
  });
  const SharedSensor sensor = BundleSensor(Shipped(), problem);
  const BundleResult result = Adjusted(problem);
  std::string all;
  for (const std::string& line : DescribeUndetermined(problem, *sensor, result)) all += line + '\n';
  EXPECT_NE(all.find("form 2 separate components"), std::string::npos) << all;
  EXPECT_NE(all.find("seen only once: the depth is undetermined"), std::string::npos) << all;
  EXPECT_NE(all.find("directions besides the scale are undetermined"), std::string::npos) << all;
}

/// The problem has 579 unknowns, including the scale, and 7200 residuals.
TEST(CeresBundle, FindsTheRankBelowTheLimitOfUnknowns) {
  BundleProblem problem = TrueBundle(60, 75).problem;
  BundleOptions options;
  options.fixed = {"intrinsics"};
  const BundleResult result = Adjusted(problem, options);
  EXPECT_EQ(result.residuals, 7200);
  EXPECT_EQ(result.unknowns, 59 * 6 + 75 * 3);
  EXPECT_LE(result.unknowns, kBundleRankUnknowns);
  EXPECT_EQ(result.rank, result.unknowns - 1);
}

/// More than 1000 unknowns remain, whether the cameras or the points are eliminated.
TEST(CeresBundle, SolvesALargeProblem) {
  BundleProblem problem = TrueBundle(120, 400).problem;
  std::erase_if(problem.observations, [](const BundleObservation& seen) {
    return (3 * seen.camera + seen.point) % 8 != 0;
  });
  Disturb(problem);
  const SharedSensor sensor = BundleSensor(Shipped(), problem);
  EXPECT_GT(BundleRms(*sensor, problem), 1.0) << "the disturbed problem has large residuals";
  const BundleResult result = Adjusted(problem);
  EXPECT_EQ(result.end, BundleEnd::kConverged) << result.message;
  EXPECT_EQ(result.unknowns, 119 * 9 + 3 + 1200);
  EXPECT_LT(BundleRms(*sensor, problem), 1e-6);
  EXPECT_EQ(result.rank, -1);
  EXPECT_EQ(DescribeUndetermined(problem, *sensor, result).back(),
            "rank: not computed (more than 600 unknowns)");
}

TEST(CeresBundle, CountsDirectionsThatNothingTells) {
  const BundleProblem problem = TrueBundle(2, 5).problem;
  const SharedSensor sensor = BundleSensor(Shipped(), problem);
  BundleResult result;
  result.unknowns = 10;
  const auto last = [&](int rank) {
    result.rank = rank;
    return DescribeUndetermined(problem, *sensor, result).back();
  };
  EXPECT_EQ(last(9), "rank: 9 of 10 unknowns: all are determined except the scale");
  EXPECT_EQ(last(8), "rank: 8 of 10 unknowns; 1 direction besides the scale is undetermined");
  EXPECT_EQ(last(7), "rank: 7 of 10 unknowns; 2 directions besides the scale are undetermined");
  EXPECT_EQ(last(-1), "rank: not computed (the Jacobian is not finite)");
}

TEST(CeresBundle, RefusesAProblemWithoutObservations) {
  BundleProblem problem = TrueBundle(2, 5).problem;
  for (BundleObservation& seen : problem.observations) seen.used = false;
  const SharedSensor sensor = BundleSensor(Shipped(), problem);
  try {
    AdjustBundle(*sensor, problem, {});
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kBadData);
  }
}

TEST(CeresBundle, ABuildWithoutThePluginSaysWhatToInstall) {
  BundleProblem problem = TrueBundle(2, 5).problem;
  const SharedSensor sensor = BundleSensor(Shipped(), problem);
  try {
    AdjustBundle(*sensor, problem, {}, "/nonexistent");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kPlugin);
    const std::string text = e.what();
    EXPECT_EQ(
        text.find("this build of alidade does not include bundle adjustment; expected a build "
                  "with the Ceres solver: apt-get install libceres-dev"),
        0u)
        << text;
  }
}

/// Tests real problems. The expected numbers are those of docs/bundle_adjustment.md.
class CeresBundleData : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* const data = std::getenv("ALIDADE_DATA");
    if (data == nullptr) GTEST_SKIP() << "ALIDADE_DATA is not set";
    folder_ = std::filesystem::path(data) / "bundle-adjustment";
    if (!std::filesystem::exists(folder_)) GTEST_SKIP() << folder_ << " does not exist";
  }
  /// Returns the RMS before and after the adjustment, in px.
  std::pair<double, double> Rms(const std::string& name, const BundleOptions& options = {}) {
    BundleFile file = ReadBundle(folder_ / name);
    BundleProblem& problem = file.problem;
    const SharedSensor sensor = BundleSensor(Shipped(), problem);
    EXPECT_EQ(ExcludeUndefined(*sensor, problem), 0);
    const double before = BundleRms(*sensor, problem);
    result_ = AdjustBundle(*sensor, problem, options);
    EXPECT_EQ(result_.end, BundleEnd::kConverged) << name << ": " << result_.message;
    EXPECT_NEAR(result_.extent_after / result_.extent_before, 1.0, 1e-14);
    const double after = BundleRms(*sensor, problem);
    if (file.format != BundleFormat::kLibmv) {
      std::ifstream read(folder_ / name);
      std::istringstream written(BundleText(file));
      ExpectFormula(file, read, before);
      ExpectFormula(file, written, after);
    }
    return {before, after};
  }
  /// Checks the RMS of `text` with the formula of its format. The tolerance is 1e-9 px, because an
  /// RMS of 1e-13 px is a rounding error.
  static void ExpectFormula(const BundleFile& file, std::istream& text, double rms) {
    const testing::FormulaCost cost = file.format == BundleFormat::kBal
                                          ? testing::BalFormula(text)
                                          : testing::BundlerFormula(text);
    EXPECT_EQ(cost.observations, std::ssize(file.problem.observations));
    EXPECT_NEAR(cost.Rms(), rms, 1e-9);
  }
  std::filesystem::path folder_;
  BundleResult result_;
};

// There are 42 unknowns for 38 residuals, so all residuals can vanish.
TEST_F(CeresBundleData, Dubrovnik) {
  const auto [before, after] = Rms("dubrovnik-3-7-pre.txt");
  EXPECT_NEAR(before, 17.06, 0.005);
  EXPECT_LT(after, 0.0305);
  EXPECT_EQ(result_.rank, 38);
}
TEST_F(CeresBundleData, DubrovnikOf18Observations) {
  const auto [before, after] = Rms("dubrovnik-3-7-18-pre.txt");
  EXPECT_NEAR(before, 17.49, 0.005);
  EXPECT_LT(after, 1e-9);
}
TEST_F(CeresBundleData, Balbianello) {
  const auto [before, after] = Rms("Balbianello.out");
  EXPECT_NEAR(before, 0.423262, 1e-6);
  EXPECT_NEAR(after, 0.420319, 1e-6);
}
TEST_F(CeresBundleData, Libmv) {
  const auto [before, after] = Rms("libmv/problem_02.bin");
  EXPECT_NEAR(before, 0.790211, 1e-6);
  EXPECT_NEAR(after, 0.770025, 1e-6);
  BundleOptions options;
  options.fixed = {"intrinsics"};
  EXPECT_NEAR(Rms("libmv/problem_01.bin", options).second, 1.3038, 1e-4);
}

}  // namespace
}  // namespace alidade
