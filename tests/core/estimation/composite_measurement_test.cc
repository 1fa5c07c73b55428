// SPDX-License-Identifier: Apache-2.0
//
// Tests composite measurements, which have several parts with one covariance. If the parts are
// independent, the result must equal that of separate measurements of the parts. Otherwise it must
// equal the closed form of the Kalman update.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <memory>
#include <vector>

#include "alidade/estimation/ekf.h"
#include "alidade/estimation/iekf.h"
#include "alidade/estimation/rts.h"
#include "alidade/estimation/square_root_ekf.h"
#include "alidade/estimation/ukf.h"
#include "support/manifold_models.h"
#include "support/systems.h"

namespace alidade {
namespace {

using testing::AddMotion;
using testing::AddSensor;
using testing::ManifoldSensor;
using testing::ManifoldWalk;
using testing::StreamsOf;

/// Measures both blocks at once. Each block is measured with the noise of ManifoldSensor.
template <class A, class B>
struct BothAtOnce : Sensor<Product<A, B>, A, B> {
  static constexpr std::array kRoles{Quantity{"a"}, Quantity{"b"}};
  static constexpr Quantity kMeasurement{"both"};
  static constexpr std::array kParts{Quantity{"a"}, Quantity{"b"}};
  template <class T>
  bool Predict(const T* a, const T* b, T* z) const {
    std::copy_n(a, A::kAmbient, z);
    std::copy_n(b, B::kAmbient, z + A::kAmbient);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    for (int i = 0; i < A::kTangent + B::kTangent; ++i) {
      l[(A::kTangent + B::kTangent + 1) * i] = T(0.05);
    }
  }
};

/// Returns a problem with a block of geometry A and a block of geometry B. Both blocks perform a
/// random walk.
template <class A, class B>
Problem Walking() {
  Problem problem;
  const auto add = [&](const char* name, const SharedMotion& model, std::vector<double> mean) {
    AddMotion(problem, name, model, {{"x", 0.0, 0.1}});
    Prior& prior = problem.priors.back();
    const Geometry& geometry = model->blocks()[0].geometry;
    prior.mean = std::move(mean);
    prior.mean.resize(static_cast<std::size_t>(geometry.ambient));
    geometry.Normalise(prior.mean.data());
    prior.covariance = 0.01 * Eigen::MatrixXd::Identity(geometry.tangent, geometry.tangent);
  };
  add("a", MakeMotion(ManifoldWalk<A, 0.03>(), "walk"), {0.3, -0.2, 0.5, 0.4});
  add("b", MakeMotion(ManifoldWalk<B, 0.03>(), "walk"), {0.9, 0.1, -0.3, 0.2});
  return problem;
}

/// Returns the measurements of both blocks at step k: the prior means plus noise.
std::vector<std::vector<double>> MeasuredAt(const Problem& problem, int k) {
  std::vector<std::vector<double>> z;
  for (std::size_t i = 0; i < 2; ++i) {
    const Geometry& geometry = problem.layout.blocks()[i].geometry();
    std::vector<double> d(static_cast<std::size_t>(geometry.tangent));
    for (std::size_t c = 0; c < d.size(); ++c) {
      d[c] = 0.08 * std::sin(1.3 * k + 2.0 * static_cast<double>(c + i));
    }
    z.push_back(problem.priors[i].mean);
    geometry.Plus(z[i].data(), d.data(), z[i].data());
  }
  return z;
}

using MakeEstimator = std::unique_ptr<Estimator> (*)(const Problem&);
template <class Filter, class Options>
std::unique_ptr<Estimator> MakeDefault(const Problem& problem) {
  return std::make_unique<Filter>(problem, Options(), StreamsOf(problem));
}
constexpr MakeEstimator kEstimators[] = {
    MakeDefault<Ekf, EkfOptions>, MakeDefault<Iekf, IekfOptions>,
    MakeDefault<SquareRootEkf, EkfOptions>, MakeDefault<Ukf, UkfOptions>};

template <class A, class B>
void ExpectBothAreTheTwo() {
  Problem apart = Walking<A, B>(), together = apart;
  AddSensor(apart, "za", MakeSensor(ManifoldSensor<A, 0.05>(), "a"), {"a.x"});
  AddSensor(apart, "zb", MakeSensor(ManifoldSensor<B, 0.05>(), "b"), {"b.x"});
  AddSensor(together, "z", MakeSensor(BothAtOnce<A, B>(), "both"), {"a.x", "b.x"});
  for (const MakeEstimator make : kEstimators) {
    const auto one = make(apart), other = make(together);
    for (int k = 0; k < 30; ++k) {
      const Timestamp t = TimestampFromSeconds(0.1 * k);
      const auto z = MeasuredAt(apart, k);
      std::vector<double> both = z[0];
      both.insert(both.end(), z[1].begin(), z[1].end());
      const UpdateReport& report =
          one->Process(Frame{t, {{t, 0, -1, z[0], {}}, {t, 1, -1, z[1], {}}}});
      const double nis = report.measurements()[0].nis + report.measurements()[1].nis;
      const UpdateReport& joint = other->Process(Frame{t, {{t, 0, -1, both, {}}}});
      ASSERT_EQ(joint.measurements()[0].outcome, Outcome::kAccepted);
      EXPECT_EQ(joint.measurements()[0].dof, A::kTangent + B::kTangent);
      if (k == 0) {  // before the first update the blocks are uncorrelated
        EXPECT_NEAR(joint.measurements()[0].nis, nis, 1e-10);
      }
      for (std::size_t i = 0; i < one->state().values().size(); ++i) {
        ASSERT_NEAR(other->state().values()[i], one->state().values()[i], 1e-12) << k;
      }
      ASSERT_LT((other->state().covariance().Dense() - one->state().covariance().Dense()).norm(),
                1e-12);
    }
  }
}

TEST(CompositeMeasurement, OfIndependentPartsIsTwoSensors) {
  ExpectBothAreTheTwo<Vec<3>, UnitQuaternion>();
  ExpectBothAreTheTwo<Vec<1>, UnitVector>();
  ExpectBothAreTheTwo<Angle, Vec<2>>();
}

// x' = x + P (P + R)^-1 (z - x). The full matrix R is supplied with the measurement.
TEST(CompositeMeasurement, TakesTheCovarianceThatCameWithIt) {
  Problem problem = Walking<Vec<2>, Vec<1>>();
  AddSensor(problem, "z", MakeSensor(BothAtOnce<Vec<2>, Vec<1>>(), "both"), {"a.x", "b.x"});
  Eigen::Matrix3d root;
  root << 0.1, 0, 0, 0.04, 0.08, 0, -0.03, 0.05, 0.06;
  const Eigen::Matrix3d r = root * root.transpose(), p = 0.01 * Eigen::Matrix3d::Identity();
  const Eigen::Vector3d x(0.3, -0.2, 0.9), z(0.4, -0.1, 0.7);
  const Eigen::Matrix3d gain = p * (p + r).inverse();
  const Eigen::Vector3d updated = x + gain * (z - x);
  const Eigen::Matrix3d left = p - gain * p;
  for (const MakeEstimator make : kEstimators) {
    const auto filter = make(problem);
    filter->Process(Frame{0, {{0, 0, -1, {0.4, -0.1, 0.7}, {r.data(), r.data() + 9}}}});
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(filter->state().values()[i], updated[static_cast<Eigen::Index>(i)], 1e-12);
    }
    EXPECT_LT((filter->state().covariance().Dense() - left).norm(), 1e-12);
  }
}

// An angle that is part of a composite measurement wraps: -3.1 rad and 3.1 rad differ by 0.083 rad.
TEST(CompositeMeasurement, WrapsTheAnglesAmongItsParts) {
  Problem problem = Walking<Vec<1>, Angle>();
  problem.priors[1].mean = {-3.1};
  AddSensor(problem, "z", MakeSensor(BothAtOnce<Vec<1>, Angle>(), "both"), {"a.x", "b.x"});
  for (const MakeEstimator make : kEstimators) {
    const auto filter = make(problem);
    const UpdateReport& report = filter->Process(Frame{0, {{0, 0, -1, {0.3, 3.1}, {}}}});
    ASSERT_EQ(report.measurements()[0].outcome, Outcome::kAccepted);
    EXPECT_NEAR(report.measurements()[0].innovation[1], 6.2 - 2.0 * M_PI, 1e-12);
  }
}

}  // namespace
}  // namespace alidade
