// SPDX-License-Identifier: Apache-2.0
//
// Tests full matrices R and Q from the config, in the simulator and in the filters. The filters
// must equal a Kalman filter computed here, and the means of NIS and NEES must be 1.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <string>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/experiment/source_plugin.h"
#include "alidade/model/geometry.h"
#include "alidade/plugin/plugin_host.h"
#include "support/config_text.h"
#include "support/sanitized.h"

namespace alidade {
namespace {

/// Config of a point with correlated errors of its acceleration and of its measured position.
const std::string kProblem = R"(alidade: 1
state:
  body:
    model: constant_velocity
    dimensions: 3
    noise: {kind: discrete, covariance: [[1, 0.6, 0], [0.6, 0.5, -0.2], [0, -0.2, 0.3]]}
    initial:
      position: {mean: [0, 0, 0], sigma: 1}
      velocity: {mean: [1, 0, 0], sigma: [1, 0.5, 1]}
  attitude:
    model: quaternion_pose
    noise: {linear_acceleration: 0, angular_acceleration: 0}
    constant: [position, orientation, velocity, angular_velocity]
    initial:
      position: {mean: [0, 0, 0]}
      orientation: {mean: {w: 1, x: 0, y: 0, z: 0}}
      velocity: {mean: [0, 0, 0]}
      angular_velocity: {mean: [0, 0, 0]}
sensors:
  poses:
    model: pose
    stream: poses
    roles: {position: body.position, orientation: attitude.orientation}
    covariance:
    - [0.25, 0.2, 0, 0.004, 0, 0]
    - [0.2, 0.36, -0.05, 0, 0, 0.006]
    - [0, -0.05, 0.04, 0, 0, 0]
    - [0.004, 0, 0, 0.0004, 0, 0]
    - [0, 0, 0, 0, 0.0009, 0]
    - [0, 0.006, 0, 0, 0, 0.0009]
source: {type: models, duration_s: 8, rate_hz: 5, seed: 3}
estimators: {ekf: {type: ekf, gate: none}}
)";

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

const PluginHost& Models() {
  static const PluginHost host(std::vector<std::filesystem::path>{});
  return host;
}

/// Kalman filter of the problem. The attitude is known, so the measurement of the attitude contains
/// only noise. This noise is correlated with that of the position.
struct Kalman {
  Vector6 x{0, 0, 0, 1, 0, 0};
  Matrix6 p, r;
  double t_s = 0.0, nis = 0.0;

  Kalman() {
    p = Vector6(1, 1, 1, 1, 0.25, 1).asDiagonal();
    r << 0.25, 0.2, 0, 0.004, 0, 0,     //
        0.2, 0.36, -0.05, 0, 0, 0.006,  //
        0, -0.05, 0.04, 0, 0, 0,        //
        0.004, 0, 0, 0.0004, 0, 0,      //
        0, 0, 0, 0, 0.0009, 0,          //
        0, 0.006, 0, 0, 0, 0.0009;
  }
  void Take(double at_s, const std::vector<double>& z) {
    const double dt_s = at_s - t_s;
    t_s = at_s;
    Matrix6 f = Matrix6::Identity();
    f.topRightCorner<3, 3>().diagonal().setConstant(dt_s);
    Eigen::Matrix<double, 6, 3> g;
    g << 0.5 * dt_s * dt_s * Eigen::Matrix3d::Identity(), dt_s * Eigen::Matrix3d::Identity();
    Eigen::Matrix3d q;
    q << 1, 0.6, 0, 0.6, 0.5, -0.2, 0, -0.2, 0.3;
    x = f * x;
    p = f * p * f.transpose() + g * q * g.transpose();
    Matrix6 h = Matrix6::Zero();
    h.topLeftCorner<3, 3>().setIdentity();
    Vector6 innovation;
    for (int i = 0; i < 3; ++i) innovation[i] = z[static_cast<std::size_t>(i)] - x[i];
    UnitQuaternion::Log(z.data() + 3, innovation.data() + 3);
    const Matrix6 s = h * p * h.transpose() + r;
    const Matrix6 gain = p * h.transpose() * s.inverse();
    nis = innovation.dot(s.inverse() * innovation);
    x += gain * innovation;
    p = (p - gain * s * gain.transpose()).eval();
  }
};

TEST(GivenNoiseRuns, EveryFilterIsTheKalmanFilter) {
  for (const char* type : {"ekf", "iekf", "square_root_ekf", "ukf"}) {
    SCOPED_TRACE(type);
    Config config = testing::Read(kProblem);
    config.Set("estimators.ekf.type", type, "test");
    const std::unique_ptr<Source> source = CreateSource(Models(), config, 3);
    const Experiment experiment = BuildExperiment(config, Models());
    Estimator& filter = *experiment.estimators.at(0).estimator;
    Kalman kalman;
    int taken = 0;
    for (SourceFrame frame; source->Next(frame);) {
      const UpdateReport& report = filter.Process(frame);
      ASSERT_EQ(report.measurements().size(), 1u);
      EXPECT_EQ(report.measurements()[0].outcome, Outcome::kAccepted);
      kalman.Take(Seconds(frame.timestamp), frame.measurements.at(0).values);
      EXPECT_NEAR(report.measurements()[0].nis, kalman.nis, 1e-8 * kalman.nis);
      const State& state = filter.state();
      const Eigen::MatrixXd p = state.covariance().Dense();
      ASSERT_EQ(p.rows(), 6);
      EXPECT_LT((p - kalman.p).cwiseAbs().maxCoeff(), 1e-9);
      for (int i = 0; i < 6; ++i) {
        EXPECT_NEAR(state.values()[static_cast<std::size_t>(i)], kalman.x[i], 1e-9);
      }
      ++taken;
    }
    EXPECT_EQ(taken, 41);
  }
}

/// Returns the mean of a metric over seeds. `true_r` is the R of the simulated measurements. If
/// `true_r` is empty, the measurements have the R of the filter.
double MeanOf(const std::string& metric, const std::string& true_r = "") {
  const int runs = testing::kSanitized ? 2 : 50;
  double sum = 0.0;
  for (int seed = 1; seed <= runs; ++seed) {
    Config config = testing::Read(kProblem);
    config.Set("source.seed", std::to_string(seed), "test");
    if (!true_r.empty()) {
      config.Set("source.overrides", "{sensors: {poses: {covariance: " + true_r + "}}}", "test");
    }
    Experiment experiment = BuildExperiment(config, Models());
    const RunResult run = Run(experiment, {});
    EXPECT_EQ(run.status, RunStatus::kOk) << run.reason;
    sum += run.estimators.at(0).metrics.at(metric);
  }
  return sum / runs;
}

// The mean of NIS covers 50 runs of 41 measurements with 6 elements, so its standard deviation is
// sqrt(2 / 12300) = 0.013. NEES is correlated over time within a run. Its mean covers at least 50
// runs of 6 independent elements, so its standard deviation is at most 0.08.
TEST(GivenNoiseRuns, TheSimulatorDrawsWhatTheFilterAssumes) {
  const double nis = MeanOf("nis.mean:poses"), nees = MeanOf("nees.mean:body");
  // The true R has the same variances, without the correlations that the filter assumes.
  const double other =
      MeanOf("nis.mean:poses",
             "[[0.25, 0, 0, 0, 0, 0], [0, 0.36, 0, 0, 0, 0], [0, 0, 0.04, 0, 0, 0], "
             "[0, 0, 0, 0.0004, 0, 0], [0, 0, 0, 0, 0.0009, 0], [0, 0, 0, 0, 0, 0.0009]]");
  if (testing::kSanitized) return;
  EXPECT_NEAR(nis, 1.0, 0.05);
  EXPECT_NEAR(nees, 1.0, 0.25);
  EXPECT_GT(other, 2.0);
}

}  // namespace
}  // namespace alidade
