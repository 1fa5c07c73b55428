// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>

#include "alidade/filter/ekf.h"
#include "alidade/filter/factorise.h"

namespace alidade {

/// One stacked update with all rows: transactional, so either all of it happens or nothing.
Outcome Ekf::Apply(std::span<Row* const> rows) {
  int m = 0;
  bool considering = considering_;
  for (const Row* row : rows) {
    m += BindingOf(*row).model.measurement().geometry.tangent;
    const std::vector<bool>& consider = PlanOf(*row).consider;
    considering =
        considering || std::find(consider.begin(), consider.end(), true) != consider.end();
  }
  const bool small = state_.covariance().small() && m <= Covariance::kSmall && !considering;
  const Outcome outcome = small ? ApplySmall(rows, m) : ApplyLarge(rows);
  if (outcome == Outcome::kNotPd) {
    Note("not_pd", "the update would leave S or P not positive definite; rolled back");
  } else if (outcome == Outcome::kNotFinite) {
    Note("not_finite", "the update is not finite; rolled back");
  }
  return outcome;
}

void Ekf::RecordUpdate(std::span<Row* const> rows, const double* gain) {
  interval_steps_ = 0;
  const int n = state_.covariance().size();
  for (const Row* row : rows) {
    MeasurementReport& entry = EntryOf(*row);
    const double* const end = gain + n * entry.dof;
    if (BindingOf(*row).model.has_landmark()) {  // its gain is not recorded
      gain = end;
      continue;
    }
    if (order_.empty()) entry.gain.assign(gain, end);
    for (; gain != end; gain += n) {
      for (const int i : order_) entry.gain.push_back(gain[i]);
    }
  }
  const Row& last = *rows.back();
  last_used_.sensor = last.sensor;
  last_used_.timestamp = last.measurement->timestamp;
  last_used_.z.assign(last.measurement->values.begin(), last.measurement->values.end());
}

/// Few states and few rows: nothing is allocated.
Outcome Ekf::ApplySmall(std::span<Row* const> rows, int m) {
  constexpr std::size_t kMost = Covariance::kSmall;
  std::array<double, kMost * kMost> pht, s, w, gain;
  std::array<double, kMost> innovation, inverse_d, dx;
  const auto n = static_cast<std::size_t>(state_.covariance().size());
  const auto all = static_cast<std::size_t>(m);
  std::size_t at = 0;
  for (const Row* row : rows) {
    const MeasurementReport& entry = EntryOf(*row);
    const JacobianRows h = JacobianOf(*row);
    const auto k = static_cast<std::size_t>(entry.dof);
    std::copy(row->pht.begin(), row->pht.end(), pht.begin() + at * n);
    std::copy(entry.innovation.begin(), entry.innovation.end(), innovation.begin() + at);
    for (std::size_t i = 0; i < k; ++i) {
      for (std::size_t j = 0; j < k; ++j) s[(at + i) * all + at + j] = entry.s[i * k + j];
      for (std::size_t j = 0; j < at; ++j) {  // H of this row times P H' of those before
        double sum = 0.0;
        for (const JacobianPart& part : h.parts) {
          for (int c = 0; c < part.size; ++c) {
            sum += h.data[i * static_cast<std::size_t>(h.stride) +
                          static_cast<std::size_t>(part.column + c)] *
                   pht[j * n + static_cast<std::size_t>(part.offset + c)];
          }
        }
        s[(at + i) * all + j] = s[j * all + at + i] = sum;
      }
    }
    at += k;
  }
  Covariance& p = state_.covariance();
  if (!p.Solve(m, pht.data(), s.data(), innovation.data(), w.data(), inverse_d.data(), dx.data(),
               gain.data())) {
    return Outcome::kNotPd;
  }
  if (correction_ != nullptr) std::copy_n(correction_, n, dx.begin());
  if (!AllFinite({dx.data(), n})) return Outcome::kNotFinite;
  state_.Retract(dx.data(), moved_);
  if (!AllFinite(moved_)) return Outcome::kNotFinite;
  if (!p.Downdate(m, w.data(), inverse_d.data())) return ApplyLarge(rows);
  state_.MoveTo(moved_);  // last: P turns with the tangent planes
  RecordUpdate(rows, gain.data());
  return Outcome::kAccepted;
}

/// P H' of all rows, n x m.
Workspace::Matrix Ekf::ProjectionOf(std::span<Row* const> rows) {
  const Eigen::Index n = state_.covariance().size();
  Eigen::Index m = 0;
  for (const Row* row : rows) m += BindingOf(*row).model.measurement().geometry.tangent;
  Workspace::Matrix pht = work_.Take(n, m);
  m = 0;
  for (const Row* row : rows) {
    const Eigen::Index k = BindingOf(*row).model.measurement().geometry.tangent;
    pht.middleCols(m, k) = Eigen::Map<const Eigen::MatrixXd>(row->pht.data(), n, k);
    m += k;
  }
  return pht;
}

Outcome Ekf::ApplyLarge(std::span<Row* const> rows) {
  const Workspace::Use use(work_);
  const Stacked all = Stack(rows);
  const Workspace::Matrix pht = ProjectionOf(rows);
  Eigen::MatrixXd s = all.noise;
  Eigen::Index at = 0;
  for (const Row* row : rows) {
    const Eigen::Index k = EntryOf(*row).dof;
    for (const JacobianPart& part : PlanOf(*row).parts) {
      s.middleRows(at, k) +=
          all.h.block(at, part.offset, k, part.size) * pht.middleRows(part.offset, part.size);
    }
    at += k;
  }
  if (!internal::Factorise(s)) return Outcome::kNotPd;
  if (pht.rows() == 0) {  // nothing to correct, and Eigen solves for one column at least
    RecordUpdate(rows, nullptr);
    return Outcome::kAccepted;
  }
  const auto l = s.triangularView<Eigen::Lower>();
  const auto l_transposed = s.transpose().triangularView<Eigen::Upper>();
  const Eigen::MatrixXd w = l.solve(pht.transpose()).transpose();
  Eigen::MatrixXd gain = l_transposed.solve(w.transpose()).transpose();
  Eigen::MatrixXd lost = MaskConsidered(rows, gain);
  if (lost.size() > 0) lost *= l;
  Eigen::VectorXd dx = gain * all.innovation;
  if (correction_ != nullptr) std::copy_n(correction_, dx.size(), dx.data());
  state_.Retract(dx.data(), moved_);
  if (!AllFinite(moved_) || !w.allFinite() || !gain.allFinite()) return Outcome::kNotFinite;
  if (!Correct(w, lost, gain, all.h, all.noise)) return Outcome::kNotPd;
  state_.MoveTo(moved_);
  RecordUpdate(rows, gain.data());
  return Outcome::kAccepted;
}

/// Zeroes the gain of consider blocks; K - K* of what it was before, empty where nothing changed.
Eigen::MatrixXd Ekf::MaskConsidered(std::span<Row* const> rows, Eigen::MatrixXd& gain) const {
  Eigen::MatrixXd lost;
  const auto mask = [&](Eigen::Index offset, Eigen::Index size, Eigen::Index at, Eigen::Index k) {
    if (lost.size() == 0) lost = Eigen::MatrixXd::Zero(gain.rows(), gain.cols());
    lost.block(offset, at, size, k) -= gain.block(offset, at, size, k);
    gain.block(offset, at, size, k).setZero();
  };
  for (const Block& block : state_.layout().blocks()) {
    if (!block.present || block.status != BlockStatus::kConsider) continue;
    mask(block.tangent_offset, block.geometry().tangent, 0, gain.cols());
  }
  Eigen::Index at = 0;
  for (const Row* row : rows) {
    const SensorPlan& plan = PlanOf(*row);
    const Eigen::Index k = BindingOf(*row).model.measurement().geometry.tangent;
    for (std::size_t i = 0; i < plan.parts.size(); ++i) {
      if (plan.consider[i]) mask(plan.parts[i].offset, plan.parts[i].size, at, k);
    }
    at += k;
  }
  return lost;
}

/// P after the update. With the optimal gain K* it is P - W W'; with another one, K, what K lacks
/// stays: + (K - K*) S (K - K*)' = E E', E = (K - K*) L, `lost` (empty: the gain is optimal). Where
/// the difference would cancel to nothing, Joseph's form. False, and P as it was, where P would not
/// stay positive.
bool Ekf::Correct(const Eigen::MatrixXd& w, const Eigen::MatrixXd& lost,
                  const Eigen::MatrixXd& gain, const Eigen::MatrixXd& h, const Eigen::MatrixXd& r) {
  constexpr double kCancelled = 1e-10;
  Covariance& p = state_.covariance();
  bool joseph = false;
  for (int i = 0; i < p.size() && !joseph; ++i) {
    const double kept = lost.size() == 0 ? 0.0 : lost.row(i).squaredNorm();
    joseph = p.Variance(i) - w.row(i).squaredNorm() + kept < kCancelled * p.Variance(i);
  }
  if (!joseph) {
    p.SubtractOuter(w);
    if (lost.size() > 0) p.AddOuter(lost);
    return true;
  }
  Covariance updated = p;
  updated.Joseph(gain, h, r);
  for (int i = 0; i < updated.size(); ++i) {
    if (!(updated.Variance(i) >= 0.0)) return false;
  }
  p = std::move(updated);
  return true;
}

}  // namespace alidade
