// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "alidade/base/decompositions.h"
#include "condensed_run.h"

/// The first frame of a CondensedRun becomes part of its prior.
namespace alidade::ceres_batch {

/// Of the inputs up to the first frame, c of them, with its residuals r(e^) and A = dr/de, weighed:
///
///   [I; A] = Q U,   e ~ N(e^ + s, (U'U)^-1),   s = -(U'U)^-1 (e^ + A' r)
///   x      = x^ (+) (S s + S U^-1 n),   n ~ N(0, I)
///   L'     = triangle of U^-T S' = Q_L L',   e_0 = -Q_L' U s   is where x = x^
bool CondensedRun::MarginaliseFirst(Eigen::VectorXd& e) {
  ALIDADE_EXPECTS(!has_landmarks() && !epochs_.empty() && e.size() == inputs_);
  if (!epochs_.front().ends) {
    PassOnFirst();
    return true;
  }
  const Eigen::Index c = epochs_.size() > 1 ? epochs_[1].column : inputs_;
  const Eigen::Index n = initial_.covariance().size();
  Point point;
  if (!Begin(e.data(), true, point) || !Advance(0, e.data(), point)) return false;
  const Eigen::MatrixXd s = point.s.leftCols(c);
  Eigen::MatrixXd j = Eigen::MatrixXd::Identity(c, c), a;
  Eigen::VectorXd r = e.head(c), residual;
  for (const Factor& factor : epochs_.front().factors) {
    if (factor.row < 0) continue;
    if (!Residual(factor, point.x, residual, &a)) return false;
    const double root = std::sqrt(Weight(SensorOf(factor).loss, residual.norm()));
    const Eigen::Index rows = residual.size(), before = j.rows();
    j.conservativeResize(before + rows, Eigen::NoChange);
    r.conservativeResize(before + rows);
    j.bottomRows(rows) = root * a * s;
    r.tail(rows) = root * residual;
  }
  const internal::LeastSquares newest = internal::SolveLeastSquares(j, r);
  const Eigen::MatrixXd& u = newest.r;
  const Eigen::VectorXd step = -newest.x;
  Eigen::MatrixXd y = Eigen::MatrixXd::Zero(std::max(c, n), n);
  if (n > 0) y.topRows(c) = u.transpose().triangularView<Eigen::Lower>().solve(s.transpose());
  Eigen::VectorXd e0 = Eigen::VectorXd::Zero(y.rows());
  e0.head(c) = -u * step;
  const internal::LeastSquares of_y = internal::SolveLeastSquares(y, e0);
  if (!step.allFinite() || !y.allFinite()) return Fail("the prior of the window is not finite");

  initial_.values() = point.x;
  d0_ = s * step;
  l0_ = of_y.r.transpose();
  Eigen::VectorXd moved(n + e.size() - c);
  moved << of_y.q_adjoint_b.head(n), e.tail(e.size() - c);
  e = std::move(moved);
  epochs_.erase(epochs_.begin());
  Shift(static_cast<int>(n - c));
  return true;
}

/// Drops the first frame, which tells nothing; the steps to it lead to the next one.
void CondensedRun::PassOnFirst() {
  passed_on_.swap(epochs_.front().steps);
  epochs_.erase(epochs_.begin());
  if (epochs_.empty()) return;
  Epoch& next = epochs_.front();
  next.column = 0;
  next.steps.insert(next.steps.begin(), passed_on_.begin(), passed_on_.end());
  passed_on_.clear();
}

/// The places of inputs and residuals, once those of the first frame are gone.
void CondensedRun::Shift(int columns) {
  inputs_ += columns;
  for (int& column : held_) column += column < 0 ? 0 : columns;
  residuals_ = 0;
  parts_.clear();
  for (Epoch& epoch : epochs_) {
    epoch.column = &epoch == &epochs_.front() ? 0 : epoch.column + columns;
    for (Step& step : epoch.steps) {
      step.column += columns;
      step.columns += columns;
    }
    for (FirstValue& first : epoch.first_values) first.column += columns;
    for (Factor& factor : epoch.factors) {
      if (factor.row >= 0) AddPart(factor);
    }
  }
}

}  // namespace alidade::ceres_batch
