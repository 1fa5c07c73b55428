// SPDX-License-Identifier: Apache-2.0
#include "plugins/ceres/bundle/sensor_cost.h"

#include <gtest/gtest.h>

#include <cmath>

#include "alidade/estimation/direct_models.h"
#include "plugins/ceres/bundle/geometry_manifold.h"
#include "sensors/self_calibrating_feature.h"
#include "sensors/stereo_disparity.h"
#include "support/manifold_models.h"

namespace alidade::ceres_batch {
namespace {

using Values = std::vector<std::vector<double>>;

template <class G>
using Seen = testing::ManifoldSensor<G, 1.0>;

/// Sensor z = x + b. The bias b is optional.
struct Biased : Sensor<Vec<1>, Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"x"},
                                     Quantity{"b", "", "", "", ALIDADE_ROLE_OPTIONAL}};
  static constexpr Quantity kMeasurement{"z"};
  template <class T>
  bool Predict(const T* x, const T* b, T* z) const {
    z[0] = b == nullptr ? x[0] : T(x[0] + b[0]);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = T(1.0);
  }
};

std::vector<const double*> Pointers(const Values& values) {
  std::vector<const double*> pointers;
  for (const auto& value : values) pointers.push_back(value.data());
  return pointers;
}

std::vector<double> ResidualAt(const ceres::CostFunction& cost, const Values& values) {
  std::vector<double> r(static_cast<std::size_t>(cost.num_residuals()));
  EXPECT_TRUE(cost.Evaluate(Pointers(values).data(), r.data(), nullptr));
  return r;
}

/// Residual and Jacobians of a cost. Before the evaluation, the buffers contain other numbers,
/// which must be overwritten.
struct Evaluated {
  std::vector<double> r;
  Values j;
};
Evaluated At(const ceres::CostFunction& cost, const Values& values) {
  const auto m = static_cast<std::size_t>(cost.num_residuals());
  Evaluated out{std::vector<double>(m, 1e302), {}};
  std::vector<double*> pointers;
  for (const auto& value : values) out.j.emplace_back(m * value.size(), 1e302);
  for (auto& j : out.j) pointers.push_back(j.data());
  EXPECT_TRUE(cost.Evaluate(Pointers(values).data(), out.r.data(), pointers.data()));
  return out;
}

/// Compares [J | 0] [I; 0], the product that Ceres computes, with central differences on the
/// manifold.
void ExpectTrueJacobians(const ceres::CostFunction& cost, const Values& values,
                         const std::vector<GeometryManifold>& manifolds, double tolerance) {
  const Evaluated at = At(cost, values);
  EXPECT_EQ(at.r, ResidualAt(cost, values)) << "with and without Jacobians";
  const int m = cost.num_residuals();
  for (std::size_t b = 0; b < values.size(); ++b) {
    const int ambient = manifolds[b].AmbientSize(), tangent = manifolds[b].TangentSize();
    std::vector<double> plus(static_cast<std::size_t>(ambient * tangent));
    ASSERT_TRUE(manifolds[b].PlusJacobian(values[b].data(), plus.data()));
    for (int c = 0; c < tangent; ++c) {
      constexpr double kStep = 1e-6;
      std::vector<double> d(static_cast<std::size_t>(tangent)), r[2];
      for (int side = 0; side < 2; ++side) {
        Values moved = values;
        d[static_cast<std::size_t>(c)] = side == 0 ? kStep : -kStep;
        ASSERT_TRUE(manifolds[b].Plus(values[b].data(), d.data(), moved[b].data()));
        r[side] = ResidualAt(cost, moved);
      }
      for (int row = 0; row < m; ++row) {
        const auto k = static_cast<std::size_t>(row);
        double sum = 0.0;
        for (int a = 0; a < ambient; ++a)
          sum += at.j[b][static_cast<std::size_t>(row * ambient + a)] *
                 plus[static_cast<std::size_t>(a * tangent + c)];
        EXPECT_NEAR(sum, (r[0][k] - r[1][k]) / (2.0 * kStep), tolerance)
            << "block " << b << " row " << row << " column " << c;
      }
    }
  }
}

GeometryManifold Of(const Geometry& geometry) { return GeometryManifold({{geometry, false}}); }

// With d = 20 / 2 = 10 px, z = 13 px and sigma = 2 px, r = -1.5 and
// dr/dZ = -10 / 2 / 2 = -2.5 per m.
TEST(SensorCost, IsTheWhitenedResidualOfTheSensor) {
  const StereoDisparity model(200.0, 0.1, 2.0);
  const SharedSensor by_abi = MakeSensor(model, "stereo_disparity");
  double z = 13.0;
  const std::vector<double> w{0.5};
  const CostKind<StereoDisparity> direct(model, {{0, 0}}, {1}, w);
  const CostKind<SensorModel> behind(*by_abi, {{0, 0}}, {1}, w);
  const SensorCost<StereoDisparity> a(direct, &z);
  const SensorCost<SensorModel> b(behind, &z);
  z = 77.0;  // the costs have copied z
  for (const ceres::CostFunction* cost :
       {static_cast<const ceres::CostFunction*>(&a), static_cast<const ceres::CostFunction*>(&b)}) {
    const Evaluated at = At(*cost, {{2.0}});
    EXPECT_DOUBLE_EQ(at.r[0], -1.5);
    EXPECT_DOUBLE_EQ(at.j[0][0], -2.5);
    const Values behind_it{{-1.0}};
    double r = 7.0;
    EXPECT_FALSE(cost->Evaluate(Pointers(behind_it).data(), &r, nullptr));
  }
}

/// One block contains the pose and the intrinsics, in an order that differs from that of the roles.
/// The noise is correlated.
TEST(SensorCost, PutsRolesIntoTheirPlacesInTheBlocks) {
  const SelfCalibratingFeature<RadialLens> model(1.0);
  const SharedSensor by_abi = MakeSensor(model, "self_calibrating_feature");
  const std::vector<RolePlace> places{{1, 3}, {1, 6}, {1, 0}, {0, 0}};
  const std::vector<int> sizes{3, 10};
  const double z[2] = {3.0, -4.0};
  const std::vector<double> w{2.0, 0.0, 0.7, 0.5}, half{0.5, 0.0, 0.0, 0.5};
  const CostKind<SelfCalibratingFeature<RadialLens>> direct(model, places, sizes, w);
  const CostKind<SensorModel> behind(*by_abi, places, sizes, w),
      equal(*by_abi, places, sizes, half);
  const SensorCost a(direct, z);
  const SensorCost b(behind, z), c(equal, z);
  const Values values{{-2.6, 1.1, 3.5}, {5.0, -0.3, 0.2, 0.4, -1.1, 0.3, 0.8, 0.2, -0.4, 0.4}};
  const std::vector<GeometryManifold> manifolds = {
      Of(Geometry::Vector(3)), GeometryManifold({{Geometry::Vector(3), false},
                                                 {Geometry::Vector(3), false},
                                                 {Geometry::UnitQuaternion(), false}})};
  // The tolerance allows for rounding errors of pixels, 1e-13 px, divided by the step.
  ExpectTrueJacobians(a, values, manifolds, 1e-6);
  ExpectTrueJacobians(b, values, manifolds, 1e-6);
  ExpectTrueJacobians(c, values, manifolds, 1e-6);
  EXPECT_EQ(At(a, values).j, At(b, values).j);
  double h[2];
  const double* const roles[] = {&values[1][3], &values[1][6], &values[1][0], &values[0][0]};
  ASSERT_EQ(by_abi->Predict(roles, h), Status::kOk);
  const std::vector<double> r = ResidualAt(a, values);
  EXPECT_NEAR(r[0], 2.0 * (h[0] - z[0]), 1e-12);
  EXPECT_NEAR(r[1], 0.7 * (h[0] - z[0]) + 0.5 * (h[1] - z[1]), 1e-12);
}

TEST(SensorCost, LeavesOutWhatIsConstant) {
  const SharedSensor sensor =
      MakeSensor(SelfCalibratingFeature<RadialLens>(1.0), "self_calibrating_feature");
  const CostKind<SensorModel> kind(*sensor, {{0, 0}, {0, 3}, {2, 0}, {1, 0}}, {7, 3, 3},
                                   {1.0, 0.0, 0.0, 1.0});
  const double z[2] = {3.0, -4.0};
  const SensorCost cost(kind, z);
  const Values values{{0.4, -1.1, 0.3, 0.8, 0.2, -0.4, 0.4}, {-2.6, 1.1, 3.5}, {5.0, -0.3, 0.2}};
  const Evaluated all = At(cost, values);
  std::vector<double> r(2), j(6, 1e302);
  double* some[] = {nullptr, j.data(), nullptr};
  ASSERT_TRUE(cost.Evaluate(Pointers(values).data(), r.data(), some));
  EXPECT_EQ(j, all.j[1]);
  EXPECT_EQ(r, all.r);
  EXPECT_EQ(all.j[0][6], 0.0);
  EXPECT_EQ(all.j[0][13], 0.0);
}

TEST(SensorCost, TakesMeasurementsOnManifolds) {
  const std::vector<double> w3{2, 0, 0, 0.3, 1, 0, -0.2, 0.4, 0.5}, w2{2, 0, 0.3, 1};
  const double q[4] = {0.8, 0.2, -0.4, 0.4}, m[3] = {0.6, 0.0, 0.8}, angle = 3.0;
  const SharedSensor turn = MakeSensor(Seen<UnitQuaternion>(), "seen");
  const CostKind<SensorModel> turns(*turn, {{0, 0}}, {4}, w3);
  ExpectTrueJacobians(SensorCost(turns, q), {{0.6, 0.0, 0.8, 0.0}},
                      {Of(Geometry::UnitQuaternion())}, 1e-7);
  const Seen<UnitVector> ray;
  const CostKind<Seen<UnitVector>> rays(ray, {{0, 0}}, {3}, w2);
  ExpectTrueJacobians(SensorCost(rays, m), {{0.0, 0.28, 0.96}}, {Of(Geometry::UnitVector())}, 1e-7);
  const SharedSensor heading = MakeSensor(Seen<Angle>(), "seen");
  const CostKind<SensorModel> headings(*heading, {{0, 0}}, {1}, {2.0});
  const SensorCost wraps(headings, &angle);
  EXPECT_NEAR(ResidualAt(wraps, {{-3.0}})[0], 2.0 * (2.0 * M_PI - 6.0), 1e-12);
  ExpectTrueJacobians(wraps, {{-3.0}}, {Of(Geometry::Angle())}, 1e-7);
}

TEST(SensorCost, MayLackAnOptionalRole) {
  const SharedSensor sensor = MakeSensor(Biased(), "biased");
  const double z = 5.0;
  const CostKind<SensorModel> with(*sensor, {{0, 0}, {1, 0}}, {1, 1}, {1.0}),
      without(*sensor, {{0, 0}, {}}, {1}, {1.0});
  EXPECT_EQ(ResidualAt(SensorCost(with, &z), {{1.0}, {0.5}})[0], -3.5);
  EXPECT_EQ(ResidualAt(SensorCost(without, &z), {{1.0}})[0], -4.0);
  EXPECT_EQ(At(SensorCost(without, &z), {{1.0}}).j[0][0], 1.0);
}

TEST(SensorCost, RefusesPlacesOutsideItsBlocks) {
  const StereoDisparity model(200.0, 0.1, 2.0);
  using Kind = CostKind<StereoDisparity>;
  EXPECT_THROW(Kind(model, {{0, 1}}, {1}, {1.0}), ContractViolation);
  EXPECT_THROW(Kind(model, {{1, 0}}, {1}, {1.0}), ContractViolation);
  EXPECT_THROW(Kind(model, {}, {1}, {1.0}), ContractViolation);
  EXPECT_THROW(Kind(model, {{0, 0}}, {1}, {1.0, 0.0}), ContractViolation);
}

// If two roles shared an element of a block, one column of the Jacobian would not be written.
TEST(SensorCost, RefusesRolesThatShareAPlace) {
  const SharedSensor sensor = MakeSensor(Biased(), "biased");
  using Kind = CostKind<SensorModel>;
  EXPECT_THROW(Kind(*sensor, {{0, 0}, {0, 0}}, {2}, {1.0}), ContractViolation);
  const double z = 5.0;
  const Kind apart(*sensor, {{0, 2}, {0, 0}}, {4}, {1.0});
  EXPECT_EQ(At(SensorCost(apart, &z), {{0.5, 7.0, 1.0, 7.0}}).j[0],
            (std::vector<double>{1.0, 0.0, 1.0, 0.0}));
  const SelfCalibratingFeature<RadialLens> model(1.0);
  const std::vector<double> w{1.0, 0.0, 0.0, 1.0};
  using Direct = CostKind<SelfCalibratingFeature<RadialLens>>;
  EXPECT_THROW(Direct(model, {{0, 0}, {0, 2}, {1, 0}, {2, 0}}, {7, 3, 3}, w), ContractViolation);
  EXPECT_THROW(Direct(model, {{0, 0}, {0, 4}, {0, 6}, {1, 0}}, {11, 3}, w), ContractViolation);
}

TEST(GeometryManifold, MovesPartsByTheirGeometryAndHoldsOthers) {
  const GeometryManifold manifold({{Geometry::Vector(2), true},
                                   {Geometry::UnitQuaternion(), false},
                                   {Geometry::Vector(1), false}});
  EXPECT_EQ(manifold.AmbientSize(), 7);
  EXPECT_EQ(manifold.TangentSize(), 4);
  const std::vector<double> x{5, 6, 0.8, 0.2, -0.4, 0.4, 7}, d{0.1, -0.2, 0.3, 0.5};
  std::vector<double> y(7), back(4), j(28), inverse(28);
  ASSERT_TRUE(manifold.Plus(x.data(), d.data(), y.data()));
  EXPECT_EQ(y[0], 5.0);
  EXPECT_EQ(y[6], 7.5);
  double q[4];
  UnitQuaternion::Plus(x.data() + 2, d.data(), q);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(y[2 + i], q[i], 1e-15);
  ASSERT_TRUE(manifold.Minus(y.data(), x.data(), back.data()));
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(back[i], d[i], 1e-14);
  ASSERT_TRUE(manifold.PlusJacobian(x.data(), j.data()));
  ASSERT_TRUE(manifold.MinusJacobian(x.data(), inverse.data()));
  const std::size_t rows[4] = {2, 3, 4, 6};  // row of the 1 in each tangent column
  for (std::size_t r = 0; r < 7; ++r) {
    for (std::size_t c = 0; c < 4; ++c) {
      EXPECT_EQ(j[4 * r + c], r == rows[c] ? 1.0 : 0.0);
      EXPECT_EQ(inverse[7 * c + r], j[4 * r + c]);
    }
  }
}

}  // namespace
}  // namespace alidade::ceres_batch
