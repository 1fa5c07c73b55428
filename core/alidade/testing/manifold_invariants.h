// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "alidade/state/manifold.h"

/// GoogleTest assertion for geometries. No other header of alidade includes GoogleTest.
namespace alidade::testing {

/// Checks that each invariant of a manifold holds within `tolerance`, for the points x and y and
/// the step d. The failure message names the first invariant that does not hold.
///
///   (1)  x (+) 0 = x
///   (2)  (x (+) d) (-) x = d      (for rotations only if |d| < pi)
///   (3)  x (+) (y (-) x) = y
///   (4)  x (+) d is a point of the manifold
///
/// Points are compared by (-), because a quaternion and its negative are the same rotation.
inline ::testing::AssertionResult ManifoldInvariantsHold(const Geometry& geometry,
                                                         const std::vector<double>& x,
                                                         const std::vector<double>& d,
                                                         const std::vector<double>& y,
                                                         double tolerance) {
  const std::vector<double> zero(static_cast<std::size_t>(geometry.tangent));
  const auto plus = [&](const std::vector<double>& step) {
    std::vector<double> point(static_cast<std::size_t>(geometry.ambient));
    geometry.Plus(x.data(), step.data(), point.data());
    return point;
  };
  const auto minus = [&](const std::vector<double>& end, const std::vector<double>& start) {
    std::vector<double> step(static_cast<std::size_t>(geometry.tangent));
    geometry.Minus(end.data(), start.data(), step.data());
    return step;
  };
  const auto distance = [](const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
    return std::sqrt(sum);
  };
  const std::vector<double> moved = plus(d);
  const struct {
    const char* law;
    double defect;
  } laws[] = {{"(1) x (+) 0 = x", distance(minus(plus(zero), x), zero)},
              {"(2) (x (+) d) (-) x = d", distance(minus(moved, x), d)},
              {"(3) x (+) (y (-) x) = y", distance(minus(plus(minus(y, x)), y), zero)},
              {"(4) x (+) d is a point of the manifold", DistanceFrom(geometry, moved.data())}};
  for (const auto& [law, defect] : laws) {
    if (defect <= tolerance) continue;  // false if the defect is NaN, which is a failure
    return ::testing::AssertionFailure()
           << law << " does not hold for " << ToString(geometry) << ": the error is " << defect
           << "; expected at most " << tolerance << "; x = " << ::testing::PrintToString(x)
           << ", d = " << ::testing::PrintToString(d) << ", y = " << ::testing::PrintToString(y);
  }
  return ::testing::AssertionSuccess();
}

}  // namespace alidade::testing
