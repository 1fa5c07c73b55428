// SPDX-License-Identifier: Apache-2.0
#include "curves.h"

#include <algorithm>
#include <utility>

#include "alidade/model/geometry.h"

namespace alidade {
namespace {

/// Returns the index i of the interval [t_i, t_i+1] that contains `t`. Returns the first interval
/// if `t` is earlier, and the last interval if `t` is later than all intervals.
std::size_t Interval(const std::vector<double>& times, double t) {
  const auto upper = std::upper_bound(times.begin() + 1, times.end() - 1, t);
  return static_cast<std::size_t>(upper - times.begin()) - 1;
}

}  // namespace

CubicSpline::CubicSpline(std::vector<double> times_s, std::vector<Eigen::Vector3d> points)
    : times_(std::move(times_s)),
      points_(std::move(points)),
      second_derivatives_(points_.size(), Eigen::Vector3d::Zero()) {
  SolveSecondDerivatives();
}

Eigen::Vector3d CubicSpline::At(double t_s) const {
  if (points_.size() == 1) return points_.front();
  const std::size_t i = Interval(times_, t_s);
  const double h = times_[i + 1] - times_[i], a = times_[i + 1] - t_s, b = t_s - times_[i];
  return (second_derivatives_[i] * a * a * a + second_derivatives_[i + 1] * b * b * b) / (6.0 * h) +
         (points_[i] / h - second_derivatives_[i] * h / 6.0) * a +
         (points_[i + 1] / h - second_derivatives_[i + 1] * h / 6.0) * b;
}

void CubicSpline::SolveSecondDerivatives() {
  const std::size_t n = points_.size();
  std::vector<double> factor(n, 0.0);
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double previous_step = times_[i] - times_[i - 1], next_step = times_[i + 1] - times_[i];
    const Eigen::Vector3d slope_change = 6.0 * ((points_[i + 1] - points_[i]) / next_step -
                                                (points_[i] - points_[i - 1]) / previous_step);
    const double pivot = 2.0 * (previous_step + next_step) - previous_step * factor[i - 1];
    factor[i] = next_step / pivot;
    second_derivatives_[i] = (slope_change - previous_step * second_derivatives_[i - 1]) / pivot;
  }
  for (std::size_t i = n - 1; i-- > 1;)
    second_derivatives_[i] -= factor[i] * second_derivatives_[i + 1];
}

RotationCurve::RotationCurve(std::vector<double> times_s, std::vector<Quaternion> values)
    : times_(std::move(times_s)), values_(std::move(values)), rates_(values_.size()) {
  const std::size_t n = values_.size();
  for (std::size_t i = 0; i < n && n > 1; ++i) {
    const Eigen::Vector3d previous_rate = Rate(i > 0 ? i - 1 : 0),
                          next_rate = Rate(i + 1 < n ? i : n - 2);
    const double h0 = i > 0 ? times_[i] - times_[i - 1] : 1.0;
    const double h1 = i + 1 < n ? times_[i + 1] - times_[i] : 1.0;
    rates_[i] = (h1 * previous_rate + h0 * next_rate) / (h0 + h1);
  }
}

Quaternion RotationCurve::At(double t_s) const {
  if (values_.size() == 1) return values_.front();
  const std::size_t i = Interval(times_, t_s);
  const double h = times_[i + 1] - times_[i], s = (t_s - times_[i]) / h;
  const Eigen::Vector3d w1 = rates_[i] * (h / 3.0), w3 = rates_[i + 1] * (h / 3.0);
  const Quaternion q_start = Plus(values_[i], w1), q_end = Plus(values_[i + 1], -w3);
  Eigen::Vector3d w2;
  UnitQuaternion::Minus(q_end.data(), q_start.data(), w2.data());
  const double u = 1.0 - s;
  Quaternion q = Plus(values_[i], (1.0 - u * u * u) * w1);
  q = Plus(q, s * s * (3.0 - 2.0 * s) * w2);
  q = Plus(q, s * s * s * w3);
  UnitQuaternion::Normalise(q.data());
  return q;
}

Quaternion RotationCurve::Plus(const Quaternion& q, const Eigen::Vector3d& d) {
  Quaternion sum;
  UnitQuaternion::Plus(q.data(), d.data(), sum.data());
  return sum;
}

Eigen::Vector3d RotationCurve::Rate(std::size_t i) const {
  Eigen::Vector3d rotation;
  UnitQuaternion::Minus(values_[i + 1].data(), values_[i].data(), rotation.data());
  return rotation / (times_[i + 1] - times_[i]);
}

}  // namespace alidade
