// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "alidade/estimation/square_root_ekf.h"
#include "support/systems.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

/// Measures a direction.
struct MeasuredDirection : Sensor<UnitVector, UnitVector> {
  static constexpr std::array kRoles{Quantity{"n", "", "", "x,y,z"}};
  static constexpr Quantity kMeasurement{"z", "", "", "x,y,z"};
  template <class T>
  bool Predict(const T* n, T* z) const {
    for (int i = 0; i < 3; ++i) z[i] = n[i];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(0.05);
    l[3] = T(0.2);
  }
};

/// Motion model of a direction that does not change.
struct Fixture : Motion<0, UnitVector> {
  static constexpr std::array kBlocks{Quantity{"n", "", "", "x,y,z"}};
  template <class T>
  void Step(const T* n, const T*, double, T* next) const {
    for (int i = 0; i < 3; ++i) next[i] = n[i];
  }
  void SqrtQ(double, MatrixRef) const {}
};

/// Returns a problem with a direction at z = 0.05. The measurement moves the direction across the
/// plane z = 0. In this plane the basis of the tangent plane is discontinuous.
Problem DirectionNearTheSeam() {
  Problem problem;
  MotionBinding binding{"d", MakeMotion(Fixture(), "still"), {}};
  binding.blocks.push_back(problem.layout.Declare("d.n", "d", binding.model->blocks()[0]));
  Prior prior;
  prior.block = 0;
  prior.mean = {std::sqrt(0.5 - 0.00125), std::sqrt(0.5 - 0.00125), 0.05};
  prior.covariance = (Eigen::Matrix2d() << 0.04, 0.01, 0.01, 0.01).finished();
  problem.priors.push_back(prior);
  problem.motions.push_back(binding);
  AddSensor(problem, "seen", MakeSensor(MeasuredDirection{}, "direction"), {"d.n"});
  return problem;
}

/// Returns the covariance of the direction as a vector in space: B P B'.
Eigen::Matrix3d InSpace(const State& state) {
  double basis[6];
  UnitVector::Basis(state.value(0), basis);
  const Eigen::Matrix<double, 3, 2> b =
      Eigen::Map<Eigen::Matrix<double, 3, 2, Eigen::RowMajor>>(basis);
  return b * state.covariance().Dense() * b.transpose();
}

// In the tangent plane at the prior, h is the identity: 1/P+ = 1/P + 1/R. The update then rotates P
// with the direction, by the smallest rotation. Tests fault 84 of tests/faults/README.md.
TEST(SquareRootEkf, CarriesTheCovarianceOfADirectionAcrossTheSeamOfItsBasis) {
  const Problem problem = DirectionNearTheSeam();
  SquareRootEkf filter(problem, {}, StreamsOf(problem));
  const Eigen::Vector3d before(problem.priors[0].mean.data());
  double basis[6];
  UnitVector::Basis(before.data(), basis);
  const Eigen::Matrix<double, 3, 2> b =
      Eigen::Map<Eigen::Matrix<double, 3, 2, Eigen::RowMajor>>(basis);
  Frame frame = FrameAt(0.0, {});
  const double side = std::sqrt(0.5 - 0.045);
  frame.measurements.push_back({0, 0, -1, {side, side, -0.3}, {}});
  filter.Process(frame);
  const Eigen::Vector3d after(filter.state().value(0));
  ASSERT_LT(after[2], 0.0);
  const Eigen::Matrix2d r = Eigen::Vector2d(0.0025, 0.04).asDiagonal();
  const Eigen::Matrix2d p = (problem.priors[0].covariance.inverse() + r.inverse().eval()).inverse();
  const Eigen::Matrix3d turn = Eigen::Quaterniond::FromTwoVectors(before, after).matrix();
  const Eigen::Matrix3d expected = turn * b * p * b.transpose() * turn.transpose();
  EXPECT_LT((InSpace(filter.state()) - expected).norm(), 1e-12);
  const Eigen::MatrixXd root = filter.root() * filter.root().transpose();
  EXPECT_LT((root - filter.state().covariance().Dense()).norm(), 1e-15);
  Ekf ekf(problem, {}, StreamsOf(problem));
  ekf.Process(frame);
  EXPECT_LT((InSpace(ekf.state()) - expected).norm(), 1e-12);
}

}  // namespace
}  // namespace alidade
