// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "alidade/model/geometry.h"

/// Smooth curves through values at given times, which increase.
namespace alidade {

using Quaternion = std::array<double, 4>;  ///< w x y z

namespace detail {

/// Index i of the interval [t_i, t_i+1] of `t`; the first or last one beyond the ends.
inline std::size_t Interval(const std::vector<double>& times, double t) {
  const auto after = std::upper_bound(times.begin() + 1, times.end() - 1, t);
  return static_cast<std::size_t>(after - times.begin()) - 1;
}

}  // namespace detail

/// Natural cubic spline through points y_i at times t_i: C2, curvature 0 at both ends.
///
///   y(t) = (M_i a^3 + M_i+1 b^3) / (6 h) + (y_i / h - M_i h / 6) a + (y_i+1 / h - M_i+1 h / 6) b
///          a = t_i+1 - t,  b = t - t_i,  h = t_i+1 - t_i
///   h_i-1 M_i-1 + 2 (h_i-1 + h_i) M_i + h_i M_i+1
///          = 6 ((y_i+1 - y_i) / h_i - (y_i - y_i-1) / h_i-1),   M_0 = M_n = 0
///
/// One point stands still; two are a straight line. Beyond the ends the outer cubics go on.
/// Source       [Press2007] sec. 3.3.
class CubicSpline {
 public:
  /// As many times as points, one at least.
  CubicSpline(std::vector<double> times_s, std::vector<Eigen::Vector3d> points)
      : times_(std::move(times_s)),
        points_(std::move(points)),
        bend_(points_.size(), Eigen::Vector3d::Zero()) {
    SolveBend();
  }

  Eigen::Vector3d At(double t_s) const {
    if (points_.size() == 1) return points_.front();
    const std::size_t i = detail::Interval(times_, t_s);
    const double h = times_[i + 1] - times_[i], a = times_[i + 1] - t_s, b = t_s - times_[i];
    return (bend_[i] * a * a * a + bend_[i + 1] * b * b * b) / (6.0 * h) +
           (points_[i] / h - bend_[i] * h / 6.0) * a +
           (points_[i + 1] / h - bend_[i + 1] * h / 6.0) * b;
  }

 private:
  /// Elimination and substitution in the tridiagonal system of M.
  void SolveBend() {
    const std::size_t n = points_.size();
    std::vector<double> factor(n, 0.0);
    for (std::size_t i = 1; i + 1 < n; ++i) {
      const double before = times_[i] - times_[i - 1], after = times_[i + 1] - times_[i];
      const Eigen::Vector3d turn =
          6.0 * ((points_[i + 1] - points_[i]) / after - (points_[i] - points_[i - 1]) / before);
      const double pivot = 2.0 * (before + after) - before * factor[i - 1];
      factor[i] = after / pivot;
      bend_[i] = (turn - before * bend_[i - 1]) / pivot;
    }
    for (std::size_t i = n - 1; i-- > 1;) bend_[i] -= factor[i] * bend_[i + 1];
  }

  std::vector<double> times_;
  std::vector<Eigen::Vector3d> points_, bend_;  ///< y_i, M_i
};

/// Cubic Bezier curve on the unit quaternions through q_i at times t_i: C1, whatever the times.
///
///   q(t) = q_i Exp(b1(s) w1) Exp(b2(s) w2) Exp(b3(s) w3),   s = (t - t_i) / h
///          b1 = 1 - (1 - s)^3,  b2 = 3 s^2 - 2 s^3,  b3 = s^3
///          w1 = omega_i h / 3,  w3 = omega_i+1 h / 3,
///          w2 = Log(Exp(-w1) q_i^-1 q_i+1 Exp(-w3))
///
/// so that the angular velocity at q_i is omega_i: the mean of those of the turns Log(q_i^-1 q_i+1)
/// before and after, each weighted with the time of the other; at the ends that of the one turn.
/// Two key frames, or several at one rate about one axis, are a slerp.
/// Source       [Kim1995] sec. 4.
class RotationCurve {
 public:
  /// As many times as unit quaternions, one at least.
  RotationCurve(std::vector<double> times_s, std::vector<Quaternion> values)
      : times_(std::move(times_s)), values_(std::move(values)), rates_(values_.size()) {
    const std::size_t n = values_.size();
    for (std::size_t i = 0; i < n && n > 1; ++i) {
      const Eigen::Vector3d before = Rate(i > 0 ? i - 1 : 0), after = Rate(i + 1 < n ? i : n - 2);
      const double h0 = i > 0 ? times_[i] - times_[i - 1] : 1.0;
      const double h1 = i + 1 < n ? times_[i + 1] - times_[i] : 1.0;
      rates_[i] = (h1 * before + h0 * after) / (h0 + h1);
    }
  }

  Quaternion At(double t_s) const {
    if (values_.size() == 1) return values_.front();
    const std::size_t i = detail::Interval(times_, t_s);
    const double h = times_[i + 1] - times_[i], s = (t_s - times_[i]) / h;
    const Eigen::Vector3d w1 = rates_[i] * (h / 3.0), w3 = rates_[i + 1] * (h / 3.0);
    const Quaternion near = Plus(values_[i], w1), far = Plus(values_[i + 1], -w3);
    Eigen::Vector3d w2;
    UnitQuaternion::Minus(far.data(), near.data(), w2.data());
    const double rest = 1.0 - s;
    Quaternion q = Plus(values_[i], (1.0 - rest * rest * rest) * w1);
    q = Plus(q, s * s * (3.0 - 2.0 * s) * w2);
    q = Plus(q, s * s * s * w3);
    Normalise<UnitQuaternion>(q.data());
    return q;
  }

 private:
  static Quaternion Plus(const Quaternion& q, const Eigen::Vector3d& d) {
    Quaternion sum;
    UnitQuaternion::Plus(q.data(), d.data(), sum.data());
    return sum;
  }
  /// Of the turn from i to i + 1, rad/s.
  Eigen::Vector3d Rate(std::size_t i) const {
    Eigen::Vector3d turn;
    UnitQuaternion::Minus(values_[i + 1].data(), values_[i].data(), turn.data());
    return turn / (times_[i + 1] - times_[i]);
  }

  std::vector<double> times_;
  std::vector<Quaternion> values_;
  std::vector<Eigen::Vector3d> rates_;  ///< omega_i
};

}  // namespace alidade
