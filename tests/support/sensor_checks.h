// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "alidade/estimation/direct_models.h"
#include "alidade/testing/jacobians.h"
#include "support/model_checks.h"

/// Short forms of the calls of a sensor, for tests of sensor models.
namespace alidade::testing {

/// Returns h(roles). An empty block is an unbound role.
inline std::vector<double> Prediction(const SharedSensor& sensor, const Blocks& roles,
                                      const double* known = nullptr) {
  std::vector<double> z = UnwrittenOutput(sensor->measurement().geometry.ambient);
  EXPECT_EQ(sensor->Predict(Pointers(roles).data(), z.data(), known), Status::kOk);
  return z;
}

/// Checks that h is not defined at the roles, and that the output is unchanged.
inline void ExpectOutOfDomain(const SharedSensor& sensor, const Blocks& roles,
                              const double* known = nullptr) {
  std::vector<double> z(static_cast<std::size_t>(sensor->measurement().geometry.ambient), kPoison);
  EXPECT_EQ(sensor->Predict(Pointers(roles).data(), z.data(), known), Status::kOutOfDomain);
  for (const double element : z) EXPECT_EQ(element, kPoison);
}

/// Compares the Jacobian of h with numeric differences. All roles must be bound.
inline void ExpectTrueJacobian(const SharedSensor& sensor, const Blocks& roles,
                               const double* known = nullptr) {
  ExpectSame(SensorJacobian(sensor, roles, known), NumericSensorJacobian(sensor, roles, known),
             kNumeric);
}

/// Returns the diagonal of L. Expects all other elements to be 0.
inline std::vector<double> NoiseDiagonal(const SharedSensor& sensor, const Blocks& roles,
                                         const double* known = nullptr) {
  const int m = sensor->measurement().geometry.tangent;
  std::vector<double> l = UnwrittenOutput(m * m), diagonal;
  const std::vector<double> z = Prediction(sensor, roles, known);
  EXPECT_EQ(sensor->SqrtNoise(Pointers(roles).data(), z.data(), l.data(), known), Status::kOk);
  for (int i = 0; i < m * m; ++i) {
    const double element = l[static_cast<std::size_t>(i)];
    if (i % (m + 1) == 0) {
      diagonal.push_back(element);
    } else {
      EXPECT_EQ(element, 0.0);
    }
  }
  return diagonal;
}

/// Returns the value of the role that the inverse measurement model computes from z.
inline std::vector<double> Initialised(const SharedSensor& sensor, const Blocks& roles,
                                       const std::vector<double>& z,
                                       const double* prior = nullptr) {
  const Space& role = sensor->roles()[static_cast<std::size_t>(sensor->inverse().role)];
  std::vector<double> y = UnwrittenOutput(role.geometry.ambient);
  EXPECT_EQ(sensor->Initialise(Pointers(roles).data(), {z.data()}, prior, {.y = y.data()}),
            Status::kOk);
  return y;
}

/// Returns the rotation matrix of a unit quaternion w x y z.
inline Eigen::Matrix3d RotationMatrix(const std::vector<double>& q) {
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
}

/// Returns a vector of the elements.
inline std::vector<double> Elements(const Eigen::VectorXd& x) {
  return {x.data(), x.data() + x.size()};
}

// Unit quaternions with exact norm: 0.1^2 + 0.1^2 + 0.7^2 + 0.7^2 = 1, and half a turn about y.
inline const std::vector<double> kAttitude{0.7, 0.1, -0.1, 0.7};
inline const std::vector<double> kNeutral{1.0, 0.0, 0.0, 0.0};
inline const double kRoot = std::sqrt(0.5);
/// Rotates x to y, y to z and z to x. All of its operations are exact.
inline const std::vector<double> kCyclicTurn{0.5, 0.5, 0.5, 0.5};
/// Rotates x to y, and y to -x: 90 degrees about z.
inline const std::vector<double> kQuarterTurn{kRoot, 0.0, 0.0, kRoot};

}  // namespace alidade::testing
