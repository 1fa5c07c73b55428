// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

/// Smooth curves through values at given, increasing times.
namespace alidade {

using Quaternion = std::array<double, 4>;  ///< w x y z

/// Natural cubic spline through points y_i at times t_i. It is C2 and has zero curvature at both
/// ends.
///
///   y(t) = (M_i a^3 + M_i+1 b^3) / (6 h) + (y_i / h - M_i h / 6) a + (y_i+1 / h - M_i+1 h / 6) b
///          a = t_i+1 - t,  b = t - t_i,  h = t_i+1 - t_i
///   h_i-1 M_i-1 + 2 (h_i-1 + h_i) M_i + h_i M_i+1
///          = 6 ((y_i+1 - y_i) / h_i - (y_i - y_i-1) / h_i-1),   M_0 = M_n = 0
///
/// For a single point the curve is constant. For two points it is a straight line. The first and
/// the last cubic continue beyond the ends.
/// Source       [Press2007] sec. 3.3.
class CubicSpline {
 public:
  /// `times_s` and `points` have the same size, at least 1.
  CubicSpline(std::vector<double> times_s, std::vector<Eigen::Vector3d> points);

  Eigen::Vector3d At(double t_s) const;

 private:
  /// Solves the tridiagonal system for M by elimination and substitution.
  void SolveSecondDerivatives();

  std::vector<double> times_;
  std::vector<Eigen::Vector3d> points_, second_derivatives_;  ///< y_i and M_i
};

/// Cubic Bezier curve on the unit quaternions through q_i at times t_i. It is C1 for any times.
///
///   q(t) = q_i Exp(b1(s) w1) Exp(b2(s) w2) Exp(b3(s) w3),   s = (t - t_i) / h
///          b1 = 1 - (1 - s)^3,  b2 = 3 s^2 - 2 s^3,  b3 = s^3
///          w1 = omega_i h / 3,  w3 = omega_i+1 h / 3,
///          w2 = Log(Exp(-w1) q_i^-1 q_i+1 Exp(-w3))
///
/// With this choice the angular velocity at q_i is omega_i. omega_i is a weighted mean of the rates
/// of the rotations Log(q_i^-1 q_i+1) before and after q_i. The weight of each rate is the duration
/// of the other rotation. At each end, omega_i is the rate of the only adjacent rotation. If there
/// are only two keyframes, the curve is a slerp. With more keyframes, the curve is a slerp if all
/// rotations have the same axis and rate. Source       [Kim1995] sec. 4.
class RotationCurve {
 public:
  /// `times_s` and `values` have the same size, at least 1; the values are unit quaternions.
  RotationCurve(std::vector<double> times_s, std::vector<Quaternion> values);

  Quaternion At(double t_s) const;

 private:
  static Quaternion Plus(const Quaternion& q, const Eigen::Vector3d& d);
  /// Returns the mean angular velocity from q_i to q_i+1, rad/s.
  Eigen::Vector3d Rate(std::size_t i) const;

  std::vector<double> times_;
  std::vector<Quaternion> values_;
  std::vector<Eigen::Vector3d> rates_;  ///< omega_i
};

}  // namespace alidade
