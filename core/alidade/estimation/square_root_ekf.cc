// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/square_root_ekf.h"

#include <Eigen/Householder>

#include "alidade/base/all_finite.h"
#include "alidade/base/error.h"
#include "alidade/estimation/ekf_equations.h"
#include "alidade/estimation/filter_engine.h"
#include "alidade/estimation/stacked_measurements.h"
#include "alidade/state/dense_algebra.h"
#include "alidade/state/tiles.h"

namespace alidade {
namespace internal {
namespace {

/// Computes the factor R of A = Q R. A is m x n, m >= n. Writes R to the upper triangle of the
/// first n rows of A. All other elements of A are then unspecified. `work` is memory for n numbers.
void Triangularise(Eigen::Ref<Eigen::MatrixXd> a, double* work) {
  for (Eigen::Index k = 0; k < a.cols(); ++k) {
    const Eigen::Index rows = a.rows() - k, columns = a.cols() - k - 1;
    double tau = 0.0, beta = 0.0;
    a.col(k).tail(rows).makeHouseholderInPlace(tau, beta);
    a(k, k) = beta;
    a.bottomRightCorner(rows, columns)
        .applyHouseholderOnTheLeft(a.col(k).tail(rows - 1), tau, work);
  }
}

/// Computes `root`, n x n, with root root' = a a' + b b'. The matrix a is n x n.
void ComputeRoot(FilterState& f, const Workspace::Matrix& a, const Workspace::Matrix& b,
                 Eigen::MatrixXd& root) {
  const Workspace::Use use(f.work);
  const Eigen::Index n = a.rows();
  Workspace::Matrix tall = f.work.Take(n + b.cols(), n);
  tall.topRows(n) = a.transpose();
  tall.bottomRows(b.cols()) = b.transpose();
  Triangularise(tall, f.work.Take(n).data());
  tall.topRows(n).triangularView<Eigen::StrictlyLower>().setZero();
  root = tall.topRows(n).transpose();
}

/// Equations of SquareRootEkf. The class uses the Jacobians of EkfEquations, stores a root of P,
/// and computes P from the root.
class SquareRootEquations : public UpdateMethod {
 public:
  std::unique_ptr<UpdateMethod> Clone() const override {
    return std::make_unique<SquareRootEquations>(*this);
  }
  void Begin(FilterState& f) override;
  StepError Step(FilterState& f, double dt_s) override;
  Outcome Predict(FilterState& f, PendingMeasurement& pending) override {
    return ekf_.Predict(f, pending);
  }
  double ComputeNis(FilterState& f, PendingMeasurement& pending) override;
  Outcome Correct(FilterState& f, std::span<PendingMeasurement* const> rows) override;

  const Eigen::MatrixXd* Root() const override { return &root_; }

 private:
  void SetCovariance(FilterState& f) const;

  /// Square root of R.
  struct NoiseRoot {
    Scratch<Eigen::LDLT<Eigen::MatrixXd>> ldlt;
    Eigen::MatrixXd root;
  };

  EkfEquations ekf_;
  Eigen::MatrixXd root_;
  Eigen::MatrixXd conditional_root_;    ///< B; used in an interval of discrete noise
  std::vector<NoiseRoot> noise_roots_;  ///< by sensor; reused memory
};

void SquareRootEquations::Begin(FilterState& f) {
  noise_roots_.resize(f.problem_index->sensor_places.size());
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
  const Workspace::Matrix transition = f.motions.Transition(f.size(), f.work);
  Workspace::Matrix moved = f.work.Take(root_.rows(), root_.cols()),
                    noise = f.motions.NoiseColumns(&Motions::Step::gl, f.size(), f.work, true);
  moved.setZero();
  AddProduct(moved, transition, continues_interval ? conditional_root_ : root_);
  if (f.motions.has_discrete_noise()) {
    noise -= f.motions.NoiseColumns(&Motions::Step::gl, f.size(), f.work);
    if ((noise.array() != 0.0).any()) {
      ComputeRoot(f, moved, noise, conditional_root_);
    } else {
      conditional_root_ = moved;
    }
    noise += f.motions.NoiseColumns(&Motions::Step::m, f.size(), f.work);
  }
  ComputeRoot(f, moved, noise, root_);
  SetCovariance(f);
  return {};
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
  // `array` is the transposed array of the update. `hl` is H L.
  Workspace::Matrix array = f.work.Take(m + n, m + n), hl = f.work.Take(m, n);
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
  Triangularise(array, f.work.Take(m + n).data());
  array.triangularView<Eigen::StrictlyLower>().setZero();
  if (!array.allFinite() || (array.diagonal().head(m).array() == 0.0).any()) return Outcome::kNotPd;
  Workspace::Matrix gain = f.work.Take(n, m), l = f.work.Take(m, m);  // K = W Ls^-1
  Workspace::Vector dx = f.work.Take(n);
  gain = array.topRightCorner(m, n).transpose();
  l = array.topLeftCorner(m, m).transpose();
  Divide(l, gain);
  dx.noalias() = gain * stacked.innovation;
  if (!f.state.Retract(dx.data(), f.moved)) return Outcome::kNotFinite;
  const Workspace::Matrix transport = TransportTo(f.state, f.moved, f.work);
  f.state.MoveTo(f.moved);
  root_.setZero();
  AddProductWithTransposed(root_, transport, array.bottomRightCorner(n, n));
  SetCovariance(f);
  RecordGain(f, rows, gain);
  return Outcome::kAccepted;
}

}  // namespace
}  // namespace internal

SquareRootEkf::SquareRootEkf(Problem problem, const EkfOptions& options,
                             const std::vector<StreamInfo>& streams)
    : Filter(CheckedProblem(std::move(problem), "SquareRootEkf", kCapabilities),
             internal::WithoutRecovery(options), streams,
             std::make_unique<internal::SquareRootEquations>()) {}

const Eigen::MatrixXd& SquareRootEkf::root() const {
  const Eigen::MatrixXd* const root = engine().method->Root();
  ALIDADE_EXPECTS(root != nullptr);
  return *root;
}

}  // namespace alidade
