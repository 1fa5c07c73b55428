// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "alidade/model/static_ekf.h"
#include "support/systems.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

/// Motion model of a rotation and a direction. Both perform a random walk, and each of them also
/// rotates about its own axis.
struct Wander : Motion<5, UnitQuaternion, UnitVector> {
  static constexpr std::array kBlocks{Quantity{"q", "", "", "w,x,y,z"},
                                      Quantity{"u", "", "", "x,y,z"}};
  template <class T>
  void Step(const T* q, const T* u, const T* w, double dt_s, T* next_q, T* next_u) const {
    const T turn[3] = {w[0] + 0.7 * dt_s, w[1] - 0.4 * dt_s, w[2] + 0.9 * dt_s};
    const T turn_u[2] = {w[3] + 1.1 * dt_s, w[4] - 0.8 * dt_s};
    UnitQuaternion::Plus(q, turn, next_q);
    UnitVector::Plus(u, turn_u, next_u);
  }
  void SqrtQ(double dt_s, MatrixRef l) const {
    for (int i = 0; i < 5; ++i) l(i, i) = 0.2 * std::sqrt(dt_s);
  }
};

/// Measures z = R(q) u, which correlates the two blocks.
struct Turned : Sensor<Vec<3>, UnitQuaternion, UnitVector> {
  static constexpr std::array kRoles{Quantity{"q", "", "", "w,x,y,z"},
                                     Quantity{"u", "", "", "x,y,z"}};
  static constexpr Quantity kMeasurement{"z", "", "", "x,y,z"};
  template <class T>
  bool Predict(const T* q, const T* u, T* z) const {
    const T pure[4] = {T(0.0), u[0], u[1], u[2]}, back[4] = {q[0], -q[1], -q[2], -q[3]};
    T half[4], turned[4];
    UnitQuaternion::Multiply(q, pure, half);
    UnitQuaternion::Multiply(half, back, turned);
    std::copy_n(turned + 1, 3, z);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    for (int i = 0; i < 3; ++i) l[4 * i] = T(0.1);
  }
};

/// Measures a direction. The noise differs between its two tangent directions.
struct Direction : Sensor<UnitVector, UnitVector> {
  static constexpr std::array kRoles{Quantity{"u", "", "", "x,y,z"}};
  static constexpr Quantity kMeasurement{"z", "", "", "x,y,z"};
  template <class T>
  bool Predict(const T* u, T* z) const {
    std::copy_n(u, 3, z);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(0.1);
    l[3] = T(0.3);
  }
};

Problem WanderSystem(const Eigen::Matrix3d& p_q, const Eigen::Matrix2d& p_u) {
  Problem problem;
  MotionBinding binding{"s", MakeMotion(Wander(), "wander"), {}};
  const std::vector<double> means[2] = {{1.0, 0.0, 0.0, 0.0}, {0.6, 0.0, 0.8}};
  for (std::size_t i = 0; i < 2; ++i) {
    const Space& space = binding.model->blocks()[i];
    Prior prior;
    prior.block = problem.layout.Declare("s." + space.name, "s", space);
    prior.mean = means[i];
    prior.covariance = i == 0 ? Eigen::MatrixXd(p_q) : Eigen::MatrixXd(p_u);
    binding.blocks.push_back(prior.block);
    problem.priors.push_back(prior);
  }
  problem.motions.push_back(binding);
  AddSensor(problem, "turned", MakeSensor(Turned(), "turned"), {"s.q", "s.u"});
  AddSensor(problem, "direction", MakeSensor(Direction(), "direction"), {"s.u"});
  return problem;
}

// Corrections are up to 0.5 rad, so P must rotate with the unit vector.
TEST(StaticEkf, CarriesCovariancesAndLengthsOnManifoldsAsTheEngineDoes) {
  const Eigen::Matrix3d p_q = Eigen::Vector3d(0.3, 0.2, 0.1).asDiagonal();
  Eigen::Matrix2d p_u;
  p_u << 0.5, 0.2, 0.2, 0.3;
  const Problem problem = WanderSystem(p_q, p_u);
  EkfOptions options;
  options.fuse = Fuse::kPerMeasurement;
  Ekf engine(problem, options, StreamsOf(problem));
  StaticEkf<Wander> filter{Wander()};
  filter.Set<0>(problem.priors[0].mean.data(), p_q);
  filter.Set<1>(problem.priors[1].mean.data(), p_u);
  bool above = false, below = false;
  Frame frame;
  for (int k = 0; k < 400; ++k) {
    std::vector<double> turned = {std::sin(1.0 * k), std::cos(0.3 * k), 0.4};
    std::vector<double> direction = {0.6 + 0.3 * std::sin(0.7 * k), std::cos(1.9 * k),
                                     std::sin(0.2 * k)};
    Geometry::UnitVector().Normalise(direction.data());
    const Timestamp before = frame.timestamp;
    frame.timestamp = TimestampFromSeconds(0.05 * k);
    frame.measurements = {{frame.timestamp, 0, -1, turned, {}},
                          {frame.timestamp, 1, -1, direction, {}}};
    engine.Process(frame);
    if (k > 0) {
      ASSERT_EQ(filter.Predict(Seconds(frame.timestamp - before)), Status::kOk);
    }
    ASSERT_EQ((filter.Update<0, 1>(Turned(), turned.data())), StaticOutcome::kAccepted);
    ASSERT_EQ(filter.Update<1>(Direction(), direction.data()), StaticOutcome::kAccepted);
    for (int i = 0; i < 4; ++i)
      ASSERT_NEAR(filter.value<0>()[i], engine.state().value(0)[i], 1e-12);
    for (int i = 0; i < 3; ++i)
      ASSERT_NEAR(filter.value<1>()[i], engine.state().value(1)[i], 1e-12);
    ASSERT_LT((filter.covariance() - engine.state().covariance().Dense()).norm(), 1e-12) << k;
    ASSERT_LT(DistanceFrom(Geometry::UnitQuaternion(), filter.value<0>()), 1e-15);
    ASSERT_LT(DistanceFrom(Geometry::UnitVector(), filter.value<1>()), 1e-15);
    above = above || filter.value<1>()[2] > 0.0;
    below = below || filter.value<1>()[2] < 0.0;  // the basis is discontinuous at z = 0
  }
  EXPECT_TRUE(above && below);
}

/// Motion model of an angle that increases steadily. The model does not wrap the angle.
struct Spin : Motion<1, Angle> {
  static constexpr std::array kBlocks{Quantity{"a", "rad"}};
  template <class T>
  void Step(const T* a, const T* w, double dt_s, T* next) const {
    next[0] = a[0] + 3.0 * dt_s + w[0];
  }
  void SqrtQ(double, MatrixRef l) const { l(0, 0) = 0.1; }
};

TEST(StaticEkf, ManyStepsLeaveNoManifold) {
  StaticEkf<Wander, Spin> filter{Wander(), Spin()};
  const double q[] = {1.0, 0.0, 0.0, 0.0}, u[] = {0.6, 0.0, 0.8};
  const auto expect_on_manifold = [&] {
    EXPECT_LT(DistanceFrom(Geometry::UnitQuaternion(), filter.value<0>()), 1e-15);
    EXPECT_LT(DistanceFrom(Geometry::UnitVector(), filter.value<1>()), 1e-15);
    EXPECT_LE(std::abs(*filter.value<2>()), 3.1415926535897933);
  };
  filter.Set<0>(q, Eigen::Matrix3d::Identity());
  filter.Set<1>(u, Eigen::Matrix2d::Identity());
  for (int k = 0; k < 20000; ++k) ASSERT_EQ(filter.Predict(0.05), Status::kOk);
  expect_on_manifold();
  filter.Set<0>(q, Eigen::Matrix3d::Identity());
  filter.Set<1>(u, Eigen::Matrix2d::Identity());
  for (int k = 0; k < 20000; ++k) {
    const double z[] = {std::sin(1.0 * k), std::cos(0.3 * k), 0.4};
    ASSERT_EQ((filter.Update<0, 1>(Turned(), z)), StaticOutcome::kAccepted);
  }
  expect_on_manifold();
}

}  // namespace
}  // namespace alidade
