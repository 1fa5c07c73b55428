// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/square_root_equations.h"

#include <cmath>
#include <limits>

#include "alidade/estimation/stacked_measurements.h"
#include "alidade/state/dense_algebra.h"
#include "alidade/state/reflections.h"
#include "alidade/state/tiles.h"

namespace alidade::internal {
namespace {

/// Computes the lower triangular root of R, k x k, which is positive semi-definite. A pivot that is
/// zero except for rounding gives a column of zeros. Only the lower triangle of `root` is written.
void RootOfNoise(const Eigen::Map<const RowMajor>& r, Eigen::Ref<Eigen::MatrixXd> root) {
  constexpr double kRounding = 4.0 * std::numeric_limits<double>::epsilon();
  for (Eigen::Index j = 0; j < r.cols(); ++j) {
    for (Eigen::Index i = j; i < r.rows(); ++i) {
      double sum = r(i, j);
      for (Eigen::Index k = 0; k < j; ++k) sum -= root(i, k) * root(j, k);
      if (i == j) sum = sum > kRounding * r(j, j) ? std::sqrt(sum) : 0.0;
      if (i > j) sum = root(j, j) > 0.0 ? sum / root(j, j) : 0.0;
      root(i, j) = sum;
    }
  }
}

/// Computes H D. Only the rows of D that belong to columns of H are read.
void Multiply(const JacobianRows& h, const ConstMatrix& d, Eigen::Ref<Eigen::MatrixXd> product) {
  const int width = h.width();
  for (Eigen::Index j = 0; j < d.cols(); ++j) {
    for (int i = 0; i < h.rows; ++i) {
      double sum = 0.0;
      for (int c = 0; c < width; ++c) {
        sum += h.data[i * width + c] * d(h.columns[static_cast<std::size_t>(c)], j);
      }
      product(i, j) = sum;
    }
  }
}

}  // namespace

void SquareRootEquations::Begin(FilterState& f) {
  // The new P does not depend on the old u.
  const Eigen::Index n = f.size(), before = variables_;
  variables_ = n;
  is_triangular_ = false;
  if (before > 0) Record(Eigen::MatrixXd(n + before, 0), Eigen::VectorXd(), before, n, before);
  Eigen::LDLT<Eigen::MatrixXd> ldlt;
  SquareRootOf(f.state.covariance().Dense(), ldlt, root_);
  SetCovariance(f);
}

/// Sets P = L L', or P = B B' + M M' in an interval of discrete noise.
void SquareRootEquations::SetCovariance(FilterState& f) const {
  const Workspace::Use use(f.work);
  LowerTriangle p = f.state.covariance().lower();
  p.setZero();
  AddOuterProduct(p, root_, 1.0);
  if (variables_ > root_.cols()) {
    AddOuterProduct(p, f.motions.DiscreteNoise(f.size(), f.work), 1.0);
  }
}

StepError SquareRootEquations::Step(FilterState& f, double dt_s) {
  if (StepError error = f.motions.Evaluate(f.state, dt_s)) return error;
  const Workspace::Use use(f.work);
  const Eigen::Index n = root_.rows(), before = variables_;
  const Workspace::Matrix noise = f.motions.ContinuousNoise(f.size(), f.work),
                          discrete = f.motions.DiscreteNoise(f.size(), f.work);
  Workspace::Matrix moved = TakePadded(f.work, n, n + noise.cols()),
                    reflectors = f.work.Take(moved.cols(), noise.cols() > 0 ? n : 0);
  AddProduct(moved.topLeftCorner(n, n), f.motions.Transition(f.size(), f.work), root_);
  moved.topRightCorner(n, noise.cols()) = noise;
  if (!std::isfinite(moved.squaredNorm() + discrete.squaredNorm())) {
    return f.motions.FindNotFinite();
  }
  f.motions.Move(f.state);
  Triangularise(moved, reflectors);
  root_ = moved.topLeftCorner(n, n);
  is_triangular_ = noise.cols() > 0;
  variables_ = n + discrete.cols();
  const bool starts_interval = variables_ > before;
  if (noise.cols() > 0 || starts_interval) {
    Record(reflectors, Eigen::VectorXd(), noise.cols(), variables_ - before, before);
  }
  SetCovariance(f);
  return {};
}

/// Triangularises the root of P, which is B or [M B], to [L 0].
Workspace::Matrix SquareRootEquations::TriangulariseRoot(FilterState& f,
                                                         Workspace::Matrix& reflectors) const {
  const Eigen::Index n = root_.rows();
  Workspace::Matrix array = TakePadded(f.work, n, variables_);
  array.topRightCorner(n, n) = root_;
  if (variables_ > n) {
    array.topLeftCorner(n, variables_ - n) = f.motions.DiscreteNoise(f.size(), f.work);
  }
  Triangularise(array, reflectors);
  return array;
}

void SquareRootEquations::Record(const ConstMatrix& reflectors,
                                 const Eigen::Ref<const Eigen::VectorXd>& y, Eigen::Index noise,
                                 Eigen::Index first, Eigen::Index size) {
  if (is_recording_) backward_steps_.push_back({reflectors, y, noise, first, size});
}

Eigen::MatrixXd SquareRootEquations::Root(const FilterState& f) const {
  if (variables_ == root_.cols()) return root_;
  Workspace work;
  Eigen::MatrixXd root(root_.rows(), variables_);
  root << f.motions.DiscreteNoise(f.size(), work), root_;
  return root;
}

/// Computes S = (H D) (H D)' + R, which is positive semi-definite despite rounding.
double SquareRootEquations::ComputeNis(FilterState& f, PendingMeasurement& pending) {
  const Workspace::Use use(f.work);
  const Eigen::Index m = pending.report->dof, n = root_.rows();
  Workspace::Matrix product = f.work.Take(m, variables_), s(pending.s, m, m);
  Multiply(pending.linearised.h, root_, product.rightCols(n));
  if (variables_ > n) {
    Multiply(pending.linearised.h, f.motions.DiscreteNoise(f.size(), f.work),
             product.leftCols(variables_ - n));
  }
  s = Eigen::Map<const RowMajor>(pending.R.data(), m, m);
  s.noalias() += product.lazyProduct(product.transpose());
  pending.report->s = {pending.s, pending.R.size()};
  return SquaredMahalanobis(pending.s, pending.innovation, pending.report->dof, f.work);
}

Outcome SquareRootEquations::Correct(FilterState& f, std::span<PendingMeasurement* const> rows) {
  const Workspace::Use use(f.work);
  const Eigen::Index n = root_.rows(), m = TotalDof(rows), before = variables_;
  // A triangular L separates large from small elements. Otherwise each update of a vague state adds
  // a rounding error of the large elements to the small ones.
  const bool triangularises = before > n || !is_triangular_;
  Workspace::Matrix rotation = f.work.Take(before, n), reflectors = f.work.Take(n + 1, m),
                    array = TakePadded(f.work, m + n, m + n);  // [Lr H L; 0 L]
  array.block(m, m, n, n) = root_;
  if (triangularises) {
    array.block(m, m, n, n) = TriangulariseRoot(f, rotation).topLeftCorner(n, n);
  }
  Eigen::Index offset = 0;
  for (const PendingMeasurement* pending : rows) {
    const Eigen::Index k = pending->report->dof;
    RootOfNoise({pending->R.data(), k, k}, array.block(offset, offset, k, k));
    Multiply(pending->linearised.h, array.block(m, m, n, n), array.block(offset, m, k, n));
    offset += k;
  }
  for (Eigen::Index k = 0; k < m; ++k) EliminateRow(array, k, m, reflectors.col(k).data());
  const auto factor = array.topLeftCorner(m, m);  // Ls
  if (!array.allFinite() || (factor.diagonal().array() == 0.0).any()) return Outcome::kNotPd;
  Workspace::Vector y = InnovationOf(f, rows), dx = f.work.Take(n);
  factor.triangularView<Eigen::Lower>().solveInPlace(y);
  dx.noalias() = array.block(m, 0, n, m) * y;
  if (!f.state.Retract(dx.data(), f.moved)) return Outcome::kNotFinite;
  variables_ = n;
  is_triangular_ = false;
  if (triangularises) Record(rotation, Eigen::VectorXd(), before - n, 0, before);
  Record(reflectors, y, 0, 0, n);
  root_ = array.block(m, m, n, n);
  TransportRows(f.state, f.moved, root_);
  f.state.MoveTo(f.moved);
  SetCovariance(f);
  Workspace::Matrix gain = f.work.Take(n, m);  // K = W Ls^-1
  gain = array.block(m, 0, n, m);
  Divide(factor, gain);
  RecordGain(f, rows, gain);
  return Outcome::kAccepted;
}

}  // namespace alidade::internal
