// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/square_root_ekf.h"

#include "alidade/filter/ekf_snapshot.h"
#include "alidade/filter/factorise.h"
#include "alidade/filter/filter_options.h"

namespace alidade {

SquareRootEkf::SquareRootEkf(System system, const EkfOptions& options,
                             const std::vector<StreamInfo>& streams)
    : Ekf(std::move(system), internal::WithoutRecovery(options), streams, Steps::kOverridden) {
  ALIDADE_EXPECTS(!FindUnsupported(system_, kSupport));
  noise_roots_.resize(system_.sensors.size());
  Eigen::LDLT<Eigen::MatrixXd> ldlt;
  internal::SquareRootOf(state_.covariance().Dense(), ldlt, root_);
  SetCovarianceOfRoot();
}

struct SquareRootEkf::Kept : Ekf::Kept {
  explicit Kept(const SquareRootEkf& ekf)
      : Ekf::Kept(ekf), root(ekf.root_), without_held(ekf.without_held_) {}

  Eigen::MatrixXd root, without_held;
};

std::unique_ptr<Estimator::Snapshot> SquareRootEkf::Save() const {
  return std::make_unique<Kept>(*this);
}

void SquareRootEkf::Restore(const Snapshot& snapshot) {
  Ekf::Restore(snapshot);
  const auto& kept = dynamic_cast<const Kept&>(snapshot);
  root_ = kept.root;
  without_held_ = kept.without_held;
}

/// P = L L'.
void SquareRootEkf::SetCovarianceOfRoot() {
  const Workspace::Use use(work_);
  Workspace::Matrix p = work_.Take(root_.rows(), root_.rows());
  p.noalias() = root_ * root_.transpose();
  SetCovariance(p);
}

/// root, n x n, with root root' = a a' + b b', for a n x n.
void SquareRootEkf::TakeRoot(const Workspace::Matrix& a, const Workspace::Matrix& b,
                             Eigen::MatrixXd& root) {
  const Workspace::Use use(work_);
  const Eigen::Index n = a.rows();
  Workspace::Matrix tall = work_.Take(n + b.cols(), n);
  tall.topRows(n) = a.transpose();
  tall.bottomRows(b.cols()) = b.transpose();
  internal::Triangularise(tall, work_.Take(n).data());
  tall.topRows(n).triangularView<Eigen::StrictlyLower>().setZero();
  root = tall.topRows(n).transpose();
}

bool SquareRootEkf::StepOnce(double dt_s) {
  const bool goes_on = InInterval();
  if (!Ekf::StepOnce(dt_s)) return false;
  const Workspace::Use use(work_);
  const Workspace::Matrix transition = Transition();
  Workspace::Matrix moved = work_.Take(root_.rows(), root_.cols()), noise = NoiseInput();
  moved.noalias() = transition * (goes_on ? without_held_ : root_);
  if (holds_) {
    noise -= HeldInput();
    if ((noise.array() != 0.0).any()) {
      TakeRoot(moved, noise, without_held_);
    } else {
      without_held_ = moved;
    }
    noise += HeldNoise();
  }
  TakeRoot(moved, noise, root_);
  SetCovarianceOfRoot();
  return true;
}

/// S = (H L) (H L)' + R, which rounding does not turn negative.
void SquareRootEkf::Project(Row& row) {
  const Workspace::Use use(work_);
  Row* const one[] = {&row};
  const Stacked all = Stack(one);
  const Eigen::Index m = all.h.rows();
  Workspace::Matrix hl = work_.Take(m, root_.cols()), s = work_.Take(m, m);
  hl.noalias() = all.h * root_;
  s = all.noise;
  s.noalias() += hl * hl.transpose();
  EntryOf(row).s.assign(s.data(), s.data() + s.size());
  row.pht.clear();
}

Outcome SquareRootEkf::Apply(std::span<Row* const> rows) {
  const Workspace::Use use(work_);
  const Stacked all = Stack(rows);
  const Eigen::Index n = root_.rows(), m = all.h.rows();
  Workspace::Matrix array = work_.Take(m + n, m + n), hl = work_.Take(m, n);  // array: transposed
  array.setZero();
  Eigen::Index at = 0;
  for (const Row* row : rows) {
    const Eigen::Index k = EntryOf(*row).dof;
    auto& [ldlt, root] = noise_roots_[static_cast<std::size_t>(row->sensor)];
    internal::SquareRootOf(all.noise.block(at, at, k, k), ldlt, root);
    array.block(at, at, k, k) = root.transpose();
    at += k;
  }
  hl.noalias() = all.h * root_;
  array.bottomLeftCorner(n, m) = hl.transpose();
  array.bottomRightCorner(n, n) = root_.transpose();
  internal::Triangularise(array, work_.Take(m + n).data());
  array.triangularView<Eigen::StrictlyLower>().setZero();
  if (!array.allFinite() || (array.diagonal().head(m).array() == 0.0).any()) {
    Note("not_pd", "the update would leave S not positive definite; rolled back");
    return Outcome::kNotPd;
  }
  Workspace::Matrix gain = work_.Take(n, m);  // K = W Ls^-1
  Workspace::Vector dx = work_.Take(n);
  gain = array.topRightCorner(m, n).transpose();
  array.topLeftCorner(m, m)
      .triangularView<Eigen::Upper>()
      .transpose()
      .solveInPlace<Eigen::OnTheRight>(gain);
  dx.noalias() = gain * all.innovation;
  state_.Retract(dx.data(), moved_);
  if (!AllFinite(moved_)) {
    Note("not_finite", "the update is not finite; rolled back");
    return Outcome::kNotFinite;
  }
  const Workspace::Matrix transport = TransportTo(moved_);
  state_.MoveTo(moved_);
  root_.noalias() = transport * array.bottomRightCorner(n, n).transpose();
  SetCovarianceOfRoot();
  RecordUpdate(rows, gain.data());
  return Outcome::kAccepted;
}

}  // namespace alidade
