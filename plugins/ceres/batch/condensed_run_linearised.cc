// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "alidade/base/decompositions.h"
#include "condensed_run.h"

/// The solution of a CondensedRun linearised about a given one.
namespace alidade::ceres_batch {

bool CondensedRun::Linearised(Trajectory trajectory, Eigen::VectorXd& e) {
  constexpr int kMostPasses = 20;
  constexpr double kSettled = 1e-9;  // of inputs whose sigma is 1
  Eigen::VectorXd step;
  e.setZero(inputs_);
  for (int pass = 0; pass < kMostPasses; ++pass) {
    if (!StepAbout(trajectory, e, step)) return pass > 0;
    e += step;
    if (!has_unit_vector_ || step.norm() <= kSettled) break;
  }
  return true;
}

/// To the values of `about`, where a filter has them: x' becomes x, and offset and S are carried
/// from the tangent at x' to the one at x, where x' (-) x adds to the offset.
void CondensedRun::PutAbout(const std::vector<double>& about, Point& point) const {
  for (const Block& block : initial_.layout().blocks()) {
    if (!block.has_covariance()) continue;
    const Geometry& geometry = block.geometry();
    const int at = block.tangent_offset, t = geometry.tangent;
    double* const x = point.x.data() + block.value_offset;
    const double* const to = about.data() + block.value_offset;
    Eigen::VectorXd defect(t);
    RowMajor j(t, t);
    geometry.Minus(x, to, defect.data());
    geometry.Transport(x, to, j.data());
    point.s.middleRows(at, t) = j * point.s.middleRows(at, t);
    point.offset.segment(at, t) = j * point.offset.segment(at, t) + defect;
    std::copy_n(to, geometry.ambient, x);
  }
}

bool CondensedRun::StepAbout(Trajectory& trajectory, const Eigen::VectorXd& e,
                             Eigen::VectorXd& step) {
  const int residuals = has_landmarks() ? 0 : residuals_;
  Eigen::MatrixXd j = Eigen::MatrixXd::Identity(inputs_ + residuals, inputs_);
  j.bottomRows(residuals).setZero();
  Eigen::VectorXd r = Eigen::VectorXd::Zero(inputs_ + residuals), residual;
  r.head(inputs_) = e;
  Eigen::MatrixXd a;
  Point point;
  std::vector<Point> points;
  if (!Begin(e.data(), true, point)) return false;
  for (std::size_t k = 0; k < epochs_.size(); ++k) {
    if (!FreezeEpoch(epochs_[k], e.data(), point)) return false;
    if (k < trajectory.size()) PutAbout(trajectory[k], point);
    if (has_unit_vector_ || has_landmarks()) points.push_back(point);
    for (Factor& factor : epochs_[k].factors) {
      // What is not defined here tells nothing yet; it may be at the solution.
      if (factor.row < 0 || !FreezeFactor(factor, point.x)) continue;
      if (has_landmarks() || !Residual(factor, point.x, residual, &a)) continue;
      const double root = std::sqrt(Weight(SensorOf(factor).loss, residual.norm()));
      r.segment(inputs_ + factor.row, residual.size()) = root * (residual + a * point.offset);
      j.middleRows(inputs_ + factor.row, residual.size()) = root * a * point.s;
    }
  }
  if (has_landmarks()) {
    Reduced reduced;
    if (!FreezeLandmarks(points) || !Project(e, points, Undefined::kSkipped, true, reduced)) {
      return false;
    }
    step = -reduced.llt.solve(reduced.g);
  } else {
    step = -internal::SolveLeastSquares(j, r).x;
  }
  if (!step.allFinite()) return Fail("the problem linearised about the filter has no solution");
  if (!has_unit_vector_) return true;
  trajectory.resize(points.size());
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Eigen::VectorXd d = points[k].offset + points[k].s * step;
    trajectory[k] = points[k].x;
    for (const Block& block : initial_.layout().blocks()) {
      if (!block.has_covariance()) continue;
      double* const x = trajectory[k].data() + block.value_offset;
      block.geometry().Plus(x, d.data() + block.tangent_offset, x);
    }
  }
  return true;
}

}  // namespace alidade::ceres_batch
