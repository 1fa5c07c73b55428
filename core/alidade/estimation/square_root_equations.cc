// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/square_root_equations.h"

#include <Eigen/Householder>

#include "alidade/estimation/stacked_measurements.h"
#include "alidade/state/dense_algebra.h"
#include "alidade/state/tiles.h"

namespace alidade::internal {
namespace {

/// Computes the factor R of A = Q R, for A of m x n, m >= n. Writes R to the upper triangle of the
/// first n rows of A, the Householder vectors of Q below it, and their n factors to `factors`.
/// `work` is memory for n numbers.
void Triangularise(Eigen::Ref<Eigen::MatrixXd> a, double* factors, double* work) {
  for (Eigen::Index k = 0; k < a.cols(); ++k) {
    const Eigen::Index rows = a.rows() - k, columns = a.cols() - k - 1;
    double beta = 0.0;
    a.col(k).tail(rows).makeHouseholderInPlace(factors[k], beta);
    a(k, k) = beta;
    a.bottomRightCorner(rows, columns)
        .applyHouseholderOnTheLeft(a.col(k).tail(rows - 1), factors[k], work);
  }
}

/// Returns the rows [first, first + count) of the Q of Triangularise.
Eigen::MatrixXd RowsOfQ(const Workspace::Matrix& reflectors, const Workspace::Vector& factors,
                        Eigen::Index first, Eigen::Index count) {
  const Eigen::Index m = reflectors.rows();
  Eigen::MatrixXd q = Eigen::MatrixXd::Zero(count, m);
  q.middleCols(first, count).setIdentity();
  Eigen::VectorXd work(count);
  for (Eigen::Index k = 0; k < reflectors.cols(); ++k) {
    q.rightCols(m - k).applyHouseholderOnTheRight(reflectors.col(k).tail(m - k - 1), factors[k],
                                                  work.data());
  }
  return q;
}

/// Triangularises [a b]', in which a is n x n. Computes `root` with root root' = a a' + b b'.
/// Writes the Householder vectors to `tall`.
void ComputeRoot(const Workspace::Matrix& a, const ConstMatrix& b, Workspace::Matrix& tall,
                 Workspace::Vector& factors, Workspace& memory, Eigen::MatrixXd& root) {
  const Workspace::Use use(memory);
  tall.topRows(a.rows()) = a.transpose();
  tall.bottomRows(b.cols()) = b.transpose();
  Triangularise(tall, factors.data(), memory.Take(a.rows()).data());
  root = tall.topRows(a.rows()).transpose().triangularView<Eigen::Lower>();
}

}  // namespace

void SquareRootEquations::Begin(FilterState& f) {
  noise_roots_.resize(f.problem_index->sensor_places.size());
  if (is_recording_ && root_.size() > 0) {  // the new P does not depend on the old u
    Record({Eigen::MatrixXd::Zero(variables_, f.size()),
            Eigen::MatrixXd::Identity(variables_, variables_), Eigen::VectorXd::Zero(variables_)});
  }
  variables_ = f.size();
  Eigen::LDLT<Eigen::MatrixXd> ldlt;
  SquareRootOf(f.state.covariance().Dense(), ldlt, root_);
  SetCovariance(f);
}

/// Sets P = L L'.
void SquareRootEquations::SetCovariance(FilterState& f) const {
  const Workspace::Use use(f.work);
  Workspace::Matrix p = f.work.Take(root_.rows(), root_.rows());
  p.setZero();
  AddOuterProduct(p, root_, 1.0);
  f.state.covariance().SetBlock(0, 0, p);
}

StepError SquareRootEquations::Step(FilterState& f, double dt_s) {
  const bool continues_interval = f.motions.in_interval();
  if (StepError error = ekf_.Step(f, dt_s)) return error;
  const Workspace::Use use(f.work);
  const Eigen::Index n = root_.rows();
  const Workspace::Matrix transition = f.motions.Transition(f.size(), f.work);
  Workspace::Matrix moved = f.work.Take(n, n),
                    noise = f.motions.NoiseColumns(&Motions::Step::gl, f.size(), f.work, true),
                    tall = f.work.Take(n + noise.cols(), n);
  Workspace::Vector factors = f.work.Take(n);
  moved.setZero();
  AddProduct(moved, transition, continues_interval ? conditional_root_ : root_);
  if (!f.motions.has_discrete_noise()) {
    ComputeRoot(moved, noise, tall, factors, f.work, root_);
    if (is_recording_) RecordStep(f, tall, factors, false);
  } else {
    noise -= f.motions.NoiseColumns(&Motions::Step::gl, f.size(), f.work);
    ComputeRoot(moved, noise, tall, factors, f.work, conditional_root_);
    if (is_recording_) RecordStep(f, tall, factors, continues_interval);
    noise = f.motions.NoiseColumns(&Motions::Step::m, f.size(), f.work);
    moved = conditional_root_;
    ComputeRoot(moved, noise, tall, factors, f.work, root_);
  }
  SetCovariance(f);
  return {};
}

/// Adds the backward step of a step. `reflectors` and `factors` are the result of ComputeRoot for
/// the continuous noise. If the noise of a model is discrete, u' also contains this noise after the
/// step, and u contains it if the step continues an interval.
void SquareRootEquations::RecordStep(FilterState& f, const Workspace::Matrix& reflectors,
                                     const Workspace::Vector& factors, bool continues_interval) {
  const Eigen::Index n = reflectors.cols(), noises = reflectors.rows() - n;
  const Eigen::Index discrete = f.motions.has_discrete_noise() ? noises : 0;
  const Eigen::Index discrete_before = continues_interval ? noises : 0;
  const Eigen::MatrixXd q = RowsOfQ(reflectors, factors, 0, n);
  BackwardStep step{Eigen::MatrixXd::Zero(n + discrete_before, n + discrete),
                    Eigen::MatrixXd::Zero(n + discrete_before, noises),
                    Eigen::VectorXd::Zero(n + discrete_before)};
  step.transition.topLeftCorner(n, n) = q.leftCols(n);
  step.transition.bottomRightCorner(discrete_before, discrete_before).setIdentity();
  step.noise.topRows(n) = q.rightCols(noises);
  Record(std::move(step));
}

void SquareRootEquations::Record(BackwardStep step) {
  variables_ = step.transition.cols();
  backward_steps_.push_back(std::move(step));
}

/// Adds the backward step of the end of an interval of discrete noise: [B M] u = L u'.
void SquareRootEquations::RecordEndOfInterval(FilterState& f) {
  const Workspace::Use use(f.work);
  const Eigen::Index n = root_.rows();
  const Workspace::Matrix noise = f.motions.NoiseColumns(&Motions::Step::m, f.size(), f.work);
  Workspace::Matrix moved = f.work.Take(n, n), tall = f.work.Take(n + noise.cols(), n);
  Workspace::Vector factors = f.work.Take(n);
  moved = conditional_root_;
  ComputeRoot(moved, noise, tall, factors, f.work, root_);
  const Eigen::MatrixXd q = RowsOfQ(tall, factors, 0, tall.rows());
  Record({q.leftCols(n), q.rightCols(noise.cols()), Eigen::VectorXd::Zero(tall.rows())});
}

Eigen::MatrixXd SquareRootEquations::Directions(const FilterState& f) const {
  if (!f.motions.in_interval()) return root_;
  Workspace work;
  const Workspace::Matrix noise = f.motions.NoiseColumns(&Motions::Step::m, f.size(), work);
  Eigen::MatrixXd directions(root_.rows(), root_.cols() + noise.cols());
  directions << conditional_root_, noise;
  return directions;
}

/// Computes S = (H L) (H L)' + R, which is positive semi-definite despite rounding.
double SquareRootEquations::ComputeNis(FilterState& f, PendingMeasurement& pending) {
  const Workspace::Use use(f.work);
  PendingMeasurement* const rows[] = {&pending};
  const StackedMeasurements stacked = Stack(f, rows);
  const Eigen::Index m = stacked.h.rows();
  Workspace::Matrix hl = f.work.Take(m, root_.cols()), s(pending.s, m, m);
  hl.setZero();
  AddProduct(hl, stacked.h, root_);
  s = stacked.noise;
  AddProductWithTransposed(s, hl, hl);
  pending.report->s = {pending.s, pending.R.size()};
  return SquaredMahalanobis(pending.s, pending.innovation, pending.report->dof, f.work);
}

Outcome SquareRootEquations::Correct(FilterState& f, std::span<PendingMeasurement* const> rows) {
  const Workspace::Use use(f.work);
  const StackedMeasurements stacked = Stack(f, rows);
  const Eigen::Index n = root_.rows(), m = stacked.h.rows();
  Workspace::Matrix array = f.work.Take(m + n, m + n),
                    hl = f.work.Take(m, n);  // the transposed array, and H L
  Workspace::Vector factors = f.work.Take(m + n);
  array.setZero();
  Eigen::Index offset = 0;
  for (const PendingMeasurement* pending : rows) {
    const Eigen::Index k = pending->report->dof;
    auto& [ldlt, root] = noise_roots_[static_cast<std::size_t>(pending->sensor)];
    SquareRootOf(stacked.noise.block(offset, offset, k, k), ldlt, root);
    array.block(offset, offset, k, k) = root.transpose();
    offset += k;
  }
  hl.setZero();
  AddProduct(hl, stacked.h, root_);
  array.bottomLeftCorner(n, m) = hl.transpose();
  array.bottomRightCorner(n, n) = root_.transpose();
  Triangularise(array, factors.data(), f.work.Take(m + n).data());
  Workspace::Matrix w = f.work.Take(n, m), factor = f.work.Take(m, m), l = f.work.Take(n, n);
  w = array.topRightCorner(m, n).transpose();
  factor = array.topLeftCorner(m, m).transpose();
  l = array.bottomRightCorner(n, n).transpose();
  factor.triangularView<Eigen::StrictlyUpper>().setZero();
  l.triangularView<Eigen::StrictlyUpper>().setZero();
  if (!array.allFinite() || (factor.diagonal().array() == 0.0).any()) return Outcome::kNotPd;
  Workspace::Vector y = f.work.Take(m), dx = f.work.Take(n);  // y = Ls^-1 r
  y = stacked.innovation;
  factor.triangularView<Eigen::Lower>().solveInPlace(y);
  dx.noalias() = w * y;
  if (!f.state.Retract(dx.data(), f.moved)) return Outcome::kNotFinite;
  if (is_recording_) {
    if (f.motions.in_interval()) RecordEndOfInterval(f);
    const Eigen::MatrixXd q = RowsOfQ(array, factors, m, n);
    Record({q.rightCols(n), Eigen::MatrixXd(n, 0), q.leftCols(m) * y});
  }
  const Workspace::Matrix transport = TransportTo(f.state, f.moved, f.work);
  f.state.MoveTo(f.moved);
  root_.setZero();
  AddProduct(root_, transport, l);
  SetCovariance(f);
  Divide(factor, w);  // K = W Ls^-1
  RecordGain(f, rows, w);
  return Outcome::kAccepted;
}

}  // namespace alidade::internal
