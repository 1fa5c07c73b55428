// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "support/systems.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

TEST(Ekf, UnderFirstEstimateTheJacobianOfAStationaryBlockIsThatOfItsStart) {
  // 1/scale = lambda Z. dh/dZ is evaluated at the first estimate of lambda, and dh/dlambda is
  // evaluated at the current Z.
  Problem problem = DepthFilter();
  problem.sensors.erase(problem.sensors.begin());
  EkfOptions options;
  options.jacobian = JacobianPolicy::kFirstEstimate;
  Ekf ekf(problem, options, StreamsOf(problem)), latest(problem, {}, StreamsOf(problem));
  Eigen::Vector3d x(0.35, 0.0, 3.3);
  Eigen::Matrix3d p = Eigen::Vector3d(0.01, 0.25, 0.25).asDiagonal();
  for (int k = 0; k < 5; ++k) {
    const double z = 1.0 + 0.05 * k;
    ekf.Process(FrameAt(0.1 * k, {{0, z}}));
    latest.Process(FrameAt(0.1 * k, {{0, z}}));
    if (k > 0) {
      Eigen::Matrix3d f = Eigen::Matrix3d::Identity();
      f(0, 1) = 0.1;
      const Eigen::Vector3d g(0.005, 0.1, 0.0);
      x = f * x;
      p = f * p * f.transpose() + g * g.transpose();
    }
    const Eigen::RowVector3d h(3.3, 0.0, x[0]);
    const double predicted = x[0] * x[2], sigma = 2.0 / 300.0 * std::pow(predicted, 3);
    const Eigen::Vector3d gain = p * h.transpose() / (h * p * h.transpose() + sigma * sigma);
    x += gain * (z - predicted);
    p = (Eigen::Matrix3d::Identity() - gain * h) * p;
  }
  EXPECT_NEAR(ValueOf(ekf.state(), "target.depth"), x[0], 1e-10);
  EXPECT_NEAR(ValueOf(ekf.state(), "target.depth_rate"), x[1], 1e-10);
  EXPECT_NEAR(ValueOf(ekf.state(), "template.inverse_distance"), x[2], 1e-10);
  EXPECT_LT((ekf.state().covariance().Dense() - p).norm(), 1e-10);
  EXPECT_GT(std::abs(ValueOf(latest.state(), "template.inverse_distance") - x[2]), 1e-6);
}

TEST(Ekf, AFirstEstimateIsThatOfTheMeasurementABlockStartsFrom) {
  Problem problem = DepthFilter();
  problem.priors[2] = {2, {}, {}, "inverse_scale"};
  EkfOptions options;
  options.jacobian = JacobianPolicy::kFirstEstimate;
  Ekf ekf(problem, options, StreamsOf(problem));
  ekf.Process(FrameAt(0.0, {{1, 1.05}}));
  const double lambda = 1.05 / 0.35;
  ASSERT_NEAR(ValueOf(ekf.state(), "template.inverse_distance"), lambda, 1e-12);
  ekf.Process(FrameAt(0.1, {{0, 80.0}, {1, 1.0}}));
  ASSERT_GT(std::abs(ValueOf(ekf.state(), "template.inverse_distance") - lambda), 1e-3);
  const Eigen::Matrix3d p = ekf.state().covariance().Dense();
  const double depth = ValueOf(ekf.state(), "target.depth");
  const double sigma =
      2.0 / 300.0 * std::pow(depth * ValueOf(ekf.state(), "template.inverse_distance"), 3);
  const Eigen::RowVector3d h(lambda, 0.0, depth);
  const UpdateReport& report = ekf.Process(FrameAt(0.1, {{1, 1.0}}));
  EXPECT_NEAR(report.measurements()[0].s[0], h * p * h.transpose() + sigma * sigma, 1e-12);
}

TEST(Ekf, AResetMakesANewFirstEstimate) {
  // Only the scale is measured, and the initial lambda is far from the truth. Rejection recovery
  // resets lambda to z / Z.
  Problem problem = DepthFilter();
  problem.sensors.erase(problem.sensors.begin());
  problem.priors[0].covariance(0, 0) = 1e-6;
  problem.priors[1].covariance(0, 0) = 1e-12;
  problem.priors[2].covariance(0, 0) = 1e-12;
  EkfOptions options;
  options.jacobian = JacobianPolicy::kFirstEstimate;
  options.gate = 0.999;
  Ekf ekf(problem, options, StreamsOf(problem));
  UpdateReport report;
  for (int k = 0; k < 20; ++k) report = ekf.Process(FrameAt(0.0, {{0, 2.0}}));
  ASSERT_EQ(report.events.back().kind, EventKind::kRejectionRecovery);
  const double lambda = ValueOf(ekf.state(), "template.inverse_distance");
  ASSERT_NEAR(lambda, 2.0 / 0.35, 1e-12);
  const Eigen::Matrix3d p = ekf.state().covariance().Dense();
  const Eigen::RowVector3d h(lambda, 0.0, 0.35);
  const double sigma = 2.0 / 300.0 * 8.0;  // sigma of an inverse scale of 2
  const UpdateReport& next = ekf.Process(FrameAt(0.0, {{0, 2.0}}));
  EXPECT_NEAR(next.measurements()[0].s[0], h * p * h.transpose() + sigma * sigma, 1e-12);
}

/// Motion model of a direction that does not change.
struct StillDirection : Motion<0, UnitVector> {
  static constexpr std::array kBlocks{Quantity{"u", "", "", "x,y,z"}};
  template <class T>
  void Step(const T* u, const T*, double, T* next) const {
    for (int i = 0; i < 3; ++i) next[i] = u[i];
  }
  void SqrtQ(double, MatrixRef) const {}
  bool Stationary() const { return true; }
};

/// Measures z = u.
struct DirectionFromVector : Sensor<Vec<3>, UnitVector> {
  static constexpr std::array kRoles{Quantity{"u", "", "", "x,y,z"}};
  static constexpr Quantity kMeasurement{"z", "", "", "x,y,z"};
  template <class T>
  bool Predict(const T* u, T* z) const {
    for (int i = 0; i < 3; ++i) z[i] = u[i];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    for (int i = 0; i < 3; ++i) l[4 * i] = T(0.2);
  }
};

// H d = R B(u) d. R is the shortest rotation from the latest u to the first u: R u = u0.
TEST(Ekf, UnderFirstEstimateADirectionIsCarriedFromItsLatestTangentToItsFirst) {
  Problem problem;
  MotionBinding binding{"s", MakeMotion(StillDirection(), "still"), {}};
  binding.blocks.push_back(problem.layout.Declare("s.u", "s", binding.model->blocks()[0]));
  const Eigen::Vector3d first = Eigen::Vector3d(0.8, 0.1, -0.5).normalized();
  const Eigen::Matrix2d prior{{0.9, 0.2}, {0.2, 0.1}};
  problem.priors.push_back({0, {first[0], first[1], first[2]}, prior, ""});
  problem.motions.push_back(binding);
  AddSensor(problem, "direction", MakeSensor(DirectionFromVector(), "direction"), {"s.u"});
  EkfOptions options;
  options.jacobian = JacobianPolicy::kFirstEstimate;
  Ekf ekf(problem, options, {{"direction", 3}});
  Frame frame = FrameAt(0.0, {});
  frame.measurements.push_back({0, 0, -1, {-0.2, 0.9, 0.3}, {}});
  ekf.Process(frame);
  const Eigen::Vector3d latest = Eigen::Map<const Eigen::Vector3d>(ekf.state().value(0));
  ASSERT_GT(std::acos(first.dot(latest)), 0.5);
  Eigen::Matrix<double, 3, 2, Eigen::RowMajor> basis;
  UnitVector::Basis(latest.data(), basis.data());
  const Eigen::Matrix<double, 3, 2> h =
      Eigen::Quaterniond::FromTwoVectors(latest, first).toRotationMatrix() * basis;
  const Eigen::Matrix3d s =
      h * ekf.state().covariance().Dense() * h.transpose() + 0.04 * Eigen::Matrix3d::Identity();
  const UpdateReport& report = ekf.Process(frame);
  const Eigen::Map<const Eigen::Matrix3d> found(report.measurements()[0].s.data());
  EXPECT_LT((found - s).norm(), 1e-12) << found << "\n\n" << s;
}

}  // namespace
}  // namespace alidade
