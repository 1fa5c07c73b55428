// SPDX-License-Identifier: Apache-2.0
#include "alidade/testing/manifold_invariants.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace alidade::testing {
namespace {

constexpr double kTolerance = 1e-14;

std::string Failure(const Geometry& geometry, const std::vector<double>& x,
                    const std::vector<double>& d, const std::vector<double>& y) {
  return ManifoldInvariantsHold(geometry, x, d, y, kTolerance).message();
}

TEST(ManifoldInvariants, HoldForStepsBelowHalfATurn) {
  EXPECT_EQ(Failure(Geometry::Angle(), {3.0}, {0.5}, {-3.0}), "");
  EXPECT_EQ(Failure(Geometry::UnitQuaternion(), {0.6, 0.8, 0.0, 0.0}, {0.1, 2.0, -1.0},
                    {0.0, 0.0, -0.6, 0.8}),
            "");
}

// 4 rad and 4 - 2 pi rad lead to the same angle, so the error is 2 pi.
TEST(ManifoldInvariants, AStepBeyondHalfATurnIsNamed) {
  EXPECT_EQ(Failure(Geometry::Angle(), {0.0}, {4.0}, {1.0}).substr(0, 70),
            "(2) (x (+) d) (-) x = d does not hold for angle: the error is 6.283185");
}

TEST(ManifoldInvariants, APointOffTheManifoldIsNamed) {
  const std::string failure =
      Failure(Geometry::UnitVector(), {0.0, 0.0, 1.0}, {0.1, 0.2}, {0.0, 1.1, 0.0});
  EXPECT_NE(failure.find("does not hold for unit_vector"), std::string::npos) << failure;
}

TEST(ManifoldInvariants, NotANumberIsAFailure) {
  EXPECT_NE(Failure(Geometry::Vector(1), {0.0}, {std::nan("")}, {1.0}), "");
}

}  // namespace
}  // namespace alidade::testing
