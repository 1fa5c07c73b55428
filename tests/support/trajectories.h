// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <string>

#include "alidade/evaluate/evaluate.h"

/// Generated trajectories, for tests of the evaluation of trajectories.
namespace alidade::testing {

/// Returns a trajectory on a curve in space, with a changing orientation. It contains `poses`
/// poses, one every 0.1 s, beginning at 100 s.
inline Trajectory Curve(int poses) {
  Trajectory t;
  t.name = "curve.tum";
  t.first_line = 1;
  t.row_count = poses;
  t.positions.resize(3, poses);
  for (int i = 0; i < poses; ++i) {
    const double s = 0.1 * i;
    t.rows.push_back(i);
    t.timestamps.push_back(100'000'000'000 + Timestamp{100'000'000} * i);
    t.positions.col(i) << 3.0 * std::cos(s), 2.0 * std::sin(s) + 0.1 * s, 0.5 * std::sin(2.0 * s);
    t.orientations.emplace_back(Eigen::AngleAxisd(s, Eigen::Vector3d::UnitZ()) *
                                Eigen::AngleAxisd(0.7 * s, Eigen::Vector3d::UnitX()));
  }
  return t;
}

/// Returns a trajectory on a straight line along x, without rotation. The position moves by
/// `step_m` every 0.1 s.
inline Trajectory Line(int poses, double step_m) {
  Trajectory t = Curve(poses);
  for (int i = 0; i < poses; ++i) {
    t.positions.col(i) << step_m * i, 0.0, 0.0;
    t.orientations[static_cast<std::size_t>(i)].setIdentity();
  }
  return t;
}

/// Returns a rotation by `angle` about an axis that is not a coordinate axis.
inline Eigen::Quaterniond Turn(double angle) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d(1.0, -2.0, 0.5).normalized()));
}

/// Returns the inverse of the similarity `s`.
inline Similarity Inverse(const Similarity& s) {
  Similarity inverse;
  inverse.scale = 1.0 / s.scale;
  inverse.rotation = s.rotation.transpose();
  inverse.translation = -inverse.scale * (inverse.rotation * s.translation);
  return inverse;
}

}  // namespace alidade::testing
