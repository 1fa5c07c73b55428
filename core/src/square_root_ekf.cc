// SPDX-License-Identifier: Apache-2.0
#include "alidade/square_root_ekf.h"

#include "ekf_kept.h"
#include "filter_options.h"
#include "square_root.h"

namespace alidade {

SquareRootEkf::SquareRootEkf(System system, const EkfOptions& options,
                             const std::vector<StreamInfo>& streams)
    : Ekf(std::move(system), internal::WithoutRecovery(options), streams) {
  ALIDADE_EXPECTS(!considering_ && !waiting_ && !system_.landmarks);
  Take(internal::SquareRootOf(state_.covariance().Dense()).root);
}

struct SquareRootEkf::Kept : Ekf::Kept {
  explicit Kept(const SquareRootEkf& ekf) : Ekf::Kept(ekf), root(ekf.root_) {}

  Eigen::MatrixXd root;
};

std::unique_ptr<Estimator::Snapshot> SquareRootEkf::Save() const {
  return std::make_unique<Kept>(*this);
}

void SquareRootEkf::Restore(const Snapshot& snapshot) {
  Ekf::Restore(snapshot);
  root_ = dynamic_cast<const Kept&>(snapshot).root;
}

void SquareRootEkf::Take(Eigen::MatrixXd root) {
  root_ = std::move(root);
  state_.covariance().SetBlock(0, 0, root_ * root_.transpose());
}

bool SquareRootEkf::StepOnce(double dt_s) {
  if (!Ekf::StepOnce(dt_s)) return false;
  const Eigen::MatrixXd noise = NoiseInput();
  Eigen::MatrixXd wide(root_.rows(), root_.cols() + noise.cols());
  wide << Transition() * root_, noise;
  Take(internal::Triangular(wide));
  return true;
}

/// S = (H L) (H L)' + R, which rounding does not turn negative.
void SquareRootEkf::Project(Row& row) {
  Row* const one[] = {&row};
  const Stacked all = Stack(one);
  const Eigen::MatrixXd hl = all.h * root_, s = hl * hl.transpose() + all.noise;
  EntryOf(row).s.assign(s.data(), s.data() + s.size());
  row.pht.clear();
}

Outcome SquareRootEkf::Apply(std::span<Row* const> rows) {
  const Stacked all = Stack(rows);
  const Eigen::Index n = root_.rows(), m = all.h.rows();
  const internal::SquareRoot noise = internal::SquareRootOf(all.noise);
  Eigen::MatrixXd array = Eigen::MatrixXd::Zero(m + n, m + n);
  array.topLeftCorner(m, m) = noise.root;
  array.topRightCorner(m, n) = all.h * root_;
  array.bottomRightCorner(n, n) = root_;
  const Eigen::MatrixXd triangular = internal::Triangular(array);
  const auto ls = triangular.topLeftCorner(m, m).triangularView<Eigen::Lower>();
  if (!triangular.allFinite() || (triangular.diagonal().head(m).array() == 0.0).any()) {
    Note("not_pd", "the update would leave S not positive definite; rolled back");
    return Outcome::kNotPd;
  }
  // K = W Ls^-1
  const Eigen::MatrixXd gain =
      ls.transpose().solve(triangular.bottomLeftCorner(n, m).transpose()).transpose();
  const Eigen::VectorXd dx = gain * all.innovation;
  state_.Retract(dx.data(), moved_);
  if (!AllFinite(moved_)) {
    Note("not_finite", "the update is not finite; rolled back");
    return Outcome::kNotFinite;
  }
  const Eigen::MatrixXd transport = TransportTo(moved_);
  state_.MoveTo(moved_);
  Take(transport * triangular.bottomRightCorner(n, n));
  RecordUpdate(rows, gain);
  return Outcome::kAccepted;
}

}  // namespace alidade
