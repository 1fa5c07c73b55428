// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/run_conclusions.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/systems.h"

namespace alidade::internal {
namespace {

using Lines = std::vector<std::string>;

/// Camera with the position (x, y), whose errors and standard deviations a test sets.
class CameraHistory {
 public:
  CameraHistory() {
    const Space space{"position", "m", "", {"x", "y"}, Geometry::Vector(2)};
    position_ = system_.layout.Declare("cam.position", "cam", space, BlockStatus::kEstimated);
    std::vector<BlockLayout> blocks = BlockLayoutsOf(system_, {});
    blocks[0].truth = 0;
    history.emplace_back(blocks);
  }

  /// Adds an estimate at the time k s. The true position is (k, 0).
  void Add(int k, double error_x, double sigma) {
    const double truth[] = {static_cast<double>(k), 0.0}, estimate[] = {truth[0] + error_x, 0.0};
    State state(system_.layout);
    state.Add(position_, estimate, sigma * sigma * Eigen::Matrix2d::Identity());
    history[0].Add({testing::FrameAt(k, {}), {{truth[0], truth[1]}}}, state);
  }

  std::vector<EstimateHistory> history;

 private:
  Problem system_;
  BlockId position_;
};

EstimatorResult ResultOf(const std::string& name, const std::map<std::string, double>& metrics) {
  EstimatorResult result;
  result.name = name;
  result.metrics = metrics;
  result.units = {{"cam.position", "m"}};
  result.verdict.state = VerdictState::kConsistent;
  return result;
}

RunResult RunOf(std::vector<EstimatorResult> estimators) {
  RunResult result;
  result.estimators = std::move(estimators);
  return result;
}

TEST(RunConclusions, NameTheLongestExcursion) {
  CameraHistory camera;
  // 3 and then 6 of 40 errors are above 3 sigma = 0.3 m.
  for (int k = 0; k < 40; ++k) {
    const bool is_outside = (k >= 5 && k < 8) || (k >= 20 && k < 26);
    camera.Add(k, is_outside ? 0.31 : 0.29, 0.1);
  }
  EXPECT_EQ(ConclusionLines(ConclusionsOf(RunOf({ResultOf("ekf", {})}), camera.history)),
            Lines{"ekf: the error of cam.position.x is outside 3 sigma at 9 timestamps, for the "
                  "longest time from t = 20 s to t = 25 s. (22 %; 0.3 % expected)"});
}

TEST(RunConclusions, DoNotReportExcursionsOfAnEstimatorThatDiverged) {
  CameraHistory camera;
  for (int k = 0; k < 40; ++k) camera.Add(k, 1.0, 0.1);
  EstimatorResult diverged = ResultOf("ekf", {});
  diverged.verdict.state = VerdictState::kDiverged;
  EXPECT_TRUE(ConclusionsOf(RunOf({diverged}), camera.history).empty());
}

TEST(RunConclusions, NameALoopClosure) {
  CameraHistory camera;
  // sqrt(tr P) = sqrt(2) sigma. The decrease at the start, from 10 m, is not reported.
  for (int k = 0; k < 40; ++k)
    camera.Add(k, k < 30 ? 0.5 : 0.02, k == 0 ? 10.0 : k < 30 ? 1.0 : 0.1);
  EXPECT_EQ(ConclusionLines(ConclusionsOf(RunOf({ResultOf("ekf", {})}), camera.history)),
            Lines{"ekf: at t = 30 s the sigma of cam.position fell from 1.41 m to 141 mm, and its "
                  "error from 500 mm to 20 mm. (a loop closure or a first fix)"});
}

TEST(RunConclusions, NameTheLastEstimatesOfSensorStates) {
  Problem problem;
  const Space bias{"bias", "rad/s", "", {}, Geometry::Vector(1)};
  const BlockId block = problem.layout.Declare("gyro.bias", "gyro", bias, BlockStatus::kEstimated);
  std::vector<EstimateHistory> history;
  history.emplace_back(BlockLayoutsOf(problem, {}));
  for (const double value : {0.0, 0.012345}) {
    State state(problem.layout);
    state.Add(block, &value, Eigen::Matrix<double, 1, 1>(1e-6));
    history[0].Add({testing::FrameAt(1, {}), {}}, state);
  }
  EstimatorResult estimator = ResultOf("ekf", {});
  EXPECT_TRUE(ConclusionsOf(RunOf({estimator}), history).empty()) << "no sensor owns the block";
  estimator.sensors = {"gyro"};
  EXPECT_EQ(ConclusionLines(ConclusionsOf(RunOf({estimator}), history)),
            (Lines{"ekf ends with gyro.bias 0.01235 +- 0.001 rad/s. (1 sigma; without truth)"}));
}

TEST(RunConclusions, NameTimesSince1970) {
  CameraHistory camera;
  for (int k = 0; k < 40; ++k) camera.Add(1'700'000'000 + k, 0.0, k < 20 ? 1.0 : 0.1);
  const Lines lines = ConclusionLines(ConclusionsOf(RunOf({ResultOf("ekf", {})}), camera.history));
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_TRUE(lines[0].starts_with("ekf: at t = 1700000020 s the sigma")) << lines[0];
}

TEST(RunConclusions, RankTheErrorsAndNameThoseOfSegments) {
  const RunResult result =
      RunOf({ResultOf("ekf", {{"rmse:cam.position", 0.020}}),
             ResultOf("iekf", {{"rmse:cam.position", 0.015}, {"rmse:cam.position@blind", 0.018}})});
  EXPECT_EQ(
      ConclusionLines(ConclusionsOf(result, {})),
      (Lines{"Least rmse of cam.position: iekf, 15 mm, 25 % less than ekf. (one run; "
             "with simulated data, `alidade sweep --runs 100` shows whether the difference is "
             "chance)",
             "iekf: rmse of cam.position 18 mm in segment blind."}));
}

TEST(RunConclusions, CompareTheFinalErrorWithThePath) {
  CameraHistory camera;
  for (int k = 0; k <= 10; ++k) camera.Add(k, 0.0, 0.1);
  const RunResult result = RunOf({ResultOf("ekf", {{"final_error:cam.position", 0.05}})});
  EXPECT_EQ(ConclusionLines(ConclusionsOf(result, camera.history)),
            Lines{"Path of 10 m; position error at its end: ekf 50 mm (0.5 %)."});
}

TEST(RunConclusions, NameTheLandmarksThatCauseTheErrorOfTheMap) {
  EstimatorResult estimator = ResultOf("ekf", {});
  std::vector<LandmarkEstimate>& map = estimator.landmarks.emplace();
  for (int i = 0; i < 10; ++i) {
    LandmarkEstimate& landmark = map.emplace_back();
    landmark.true_position = Eigen::Vector3d::Zero();
    landmark.position = Eigen::Vector3d(i == 3 ? 1.0 : 0.01, 0.0, 0.0);
    landmark.covariance = 0.01 * 0.01 * Eigen::Matrix3d::Identity();
  }
  // rmse = sqrt((1 + 9 * 1e-4) / 10) m
  EXPECT_EQ(ConclusionLines(ConclusionsOf(RunOf({estimator}), {})),
            Lines{"ekf: map of 10 landmarks, median error 10 mm, rmse 316 mm; 10 mm without the "
                  "worst one. (1 error is above 3 sigma)"});
}

}  // namespace
}  // namespace alidade::internal
