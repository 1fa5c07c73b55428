// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/owned_state.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "alidade/state/geometry_table.h"
#include "alidade/testing/jacobians.h"

namespace alidade {
namespace {

constexpr double kDt_s = 0.4;

OwnedRole RoleOf(const Geometry& geometry, OwnedDynamics dynamics) {
  const auto n = static_cast<std::size_t>(geometry.tangent);
  OwnedRole role;
  role.mean = geometry.Identity();
  role.dynamics = dynamics;
  role.sqrt_density.assign(n * n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k <= i; ++k)
      role.sqrt_density[i * n + k] = 0.1 * static_cast<double>(1 + i + 2 * k);
  }
  role.time_constant_s = 1.5;
  return role;
}

std::vector<double> Moved(const Geometry& geometry, const std::vector<double>& x, double length) {
  std::vector<double> d(static_cast<std::size_t>(geometry.tangent)), y = x;
  for (std::size_t i = 0; i < d.size(); ++i)
    d[i] = length * std::cos(1.0 + 2.0 * static_cast<double>(i));
  geometry.Plus(x.data(), d.data(), y.data());
  return y;
}

class OwnedMotionOf : public ::testing::TestWithParam<const GeometryRow*> {
 protected:
  const Geometry geometry_ =
      GetParam()->number == ALIDADE_VECTOR ? Geometry::Vector(3) : Geometry(GetParam()->number);
};

TEST_P(OwnedMotionOf, EachGeometryHasTheJacobiansOfItsStep) {
  for (const OwnedDynamics dynamics :
       {OwnedDynamics::kConstant, OwnedDynamics::kRandomWalk, OwnedDynamics::kGaussMarkov}) {
    const SharedMotion motion = internal::OwnedMotion(geometry_, RoleOf(geometry_, dynamics));
    const testing::Blocks x{Moved(geometry_, geometry_.Identity(), 0.6)};
    std::vector<double> w(static_cast<std::size_t>(geometry_.tangent));
    for (std::size_t i = 0; i < w.size(); ++i)
      w[i] = 0.3 * std::sin(2.0 + 3.0 * static_cast<double>(i));
    const std::array<const double*, 2> noises{nullptr, w.data()};
    for (const double* const noise : noises) {
      const auto exact = testing::StepWithJacobians(motion, x, nullptr, noise, kDt_s);
      const auto numeric = testing::NumericStep(motion, x, nullptr, noise, kDt_s);
      EXPECT_EQ(exact.next, numeric.next);
      EXPECT_LT(testing::LargestDifference(exact.f, numeric.f), 1e-8) << motion->name();
      EXPECT_LT(testing::LargestDifference(exact.g, numeric.g), 1e-8) << motion->name();
    }
  }
}

TEST_P(OwnedMotionOf, AGaussMarkovProcessReturnsToItsMean) {
  const OwnedRole role = RoleOf(geometry_, OwnedDynamics::kGaussMarkov);
  const SharedMotion motion = internal::OwnedMotion(geometry_, role);
  const auto x = Moved(geometry_, role.mean, 0.6);
  const auto expected = Moved(geometry_, role.mean, 0.6 * std::exp(-kDt_s / 1.5));
  const auto next = testing::StepWithJacobians(motion, {x}, nullptr, nullptr, kDt_s).next[0];
  EXPECT_LT(testing::LargestDifference(next, expected), 1e-14);

  const double root = std::sqrt(0.75 * (1.0 - std::exp(-2.0 * kDt_s / 1.5)));
  std::vector<double> l(role.sqrt_density.size());
  ASSERT_EQ(motion->SqrtQ(testing::Pointers(testing::Blocks{x}).data(), nullptr, kDt_s, l.data()),
            Status::kOk);
  for (std::size_t i = 0; i < l.size(); ++i) EXPECT_NEAR(l[i], root * role.sqrt_density[i], 1e-15);
}

TEST_P(OwnedMotionOf, ARandomWalkWithoutNoiseNeverChanges) {
  OwnedRole role = RoleOf(geometry_, OwnedDynamics::kRandomWalk);
  EXPECT_FALSE(internal::OwnedMotion(geometry_, role)->stationary());
  role.sqrt_density.assign(role.sqrt_density.size(), 0.0);
  EXPECT_TRUE(internal::OwnedMotion(geometry_, role)->stationary());
}

std::vector<const GeometryRow*> GeometriesOfOneBlock() {
  std::vector<const GeometryRow*> rows;
  for (const GeometryRow* row : detail::kGeometryRows) {
    if (row->number != ALIDADE_PRODUCT) rows.push_back(row);
  }
  return rows;
}
INSTANTIATE_TEST_SUITE_P(Geometries, OwnedMotionOf, ::testing::ValuesIn(GeometriesOfOneBlock()),
                         [](const auto& row) { return std::string(row.param->name); });

}  // namespace
}  // namespace alidade
