// SPDX-License-Identifier: Apache-2.0
#include "alidade/model/geometry.h"

#include <gtest/gtest.h>

#include <numbers>

#include "alidade/state/manifold.h"
#include "geometry_vectors.h"

namespace alidade {
namespace {

using testing::kPlusOfGeometries;
using testing::PlusOfGeometry;

/// Returns the geometry with the number `kind`. A vector has three elements.
Geometry Of(std::uint32_t kind) { return Geometry(kind, 3); }

constexpr double kRounding = 1e-15;

TEST(GeometryVectors, PlusIsWhatThePluginAbiSays) {
  for (const PlusOfGeometry& one : kPlusOfGeometries) {
    const Geometry geometry = Of(one.geometry);
    double y[10] = {};
    geometry.Plus(one.x.data(), one.d.data(), y);
    for (int i = 0; i < geometry.ambient; ++i) {
      EXPECT_NEAR(y[i], one.y[static_cast<std::size_t>(i)], kRounding) << one.geometry << ' ' << i;
    }
  }
}

TEST(GeometryVectors, MinusIsItsInverse) {
  for (const PlusOfGeometry& one : kPlusOfGeometries) {
    const Geometry geometry = Of(one.geometry);
    double d[9] = {};
    geometry.Minus(one.y.data(), one.x.data(), d);
    for (int i = 0; i < geometry.tangent && one.x[0] != -1e300; ++i) {
      EXPECT_NEAR(d[i], one.d[static_cast<std::size_t>(i)], 4 * kRounding) << one.geometry;
    }
  }
}

TEST(GeometryVectors, ToTheAntipodeGoesAlongTheFirstDirection) {
  const double x[3] = {0.6, 0.0, 0.8}, y[3] = {-0.6, 0.0, -0.8};
  double d[2] = {};
  Geometry::UnitVector().Minus(y, x, d);
  EXPECT_NEAR(d[0], std::numbers::pi, kRounding);
  EXPECT_EQ(d[1], 0.0);
}

}  // namespace
}  // namespace alidade
