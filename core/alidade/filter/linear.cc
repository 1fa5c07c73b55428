// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/linear.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "alidade/filter/evaluate_models.h"
#include "alidade/filter/factorise.h"
#include "alidade/filter/stack.h"
#include "alidade/state/small_kernels.h"

namespace alidade::internal {
namespace {

/// P after the update. With the optimal gain K* it is P - W W'; with another one, K, what K lacks
/// stays: + (K - K*) S (K - K*)' = E E', E = (K - K*) L, `lost` (empty: the gain is optimal). Where
/// the difference would cancel to nothing, Joseph's form. False, and P as it was, where P would not
/// stay positive.
bool Update(Covariance& p, const Eigen::MatrixXd& w, const Eigen::MatrixXd& lost,
            const Eigen::MatrixXd& gain, const Stacked& all) {
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
  updated.Joseph(gain, all.h, all.noise);
  for (int i = 0; i < updated.size(); ++i) {
    if (!(updated.Variance(i) >= 0.0)) return false;
  }
  p = std::move(updated);
  return true;
}

}  // namespace

Trouble Linear::Step(FilterState& f, double dt_s) {
  if (Trouble trouble = f.motions.Evaluate(f.state, dt_s)) return trouble;
  if (f.motions.Apply(f.state)) return {};
  return {"not_finite", "the covariance steps to what is not finite"};
}

Outcome Linear::Predict(FilterState& f, Row& row) {
  const Outcome outcome = Linearise(f, row);
  if (outcome == Outcome::kAccepted) Project(f, row);
  return outcome;
}

Outcome Linear::Linearise(FilterState& f, Row& row) {
  const Outcome outcome = LineariseAtState(f, row);
  if (outcome != Outcome::kAccepted) NoteRefusal(f, row, outcome);
  return outcome;
}

Outcome Linear::LineariseAtState(FilterState& f, Row& row) {
  MeasurementReport& entry = *row.report;
  const Geometry& geometry = row.model->measurement().geometry;
  const double* const* const roles = RolesAt(f, row, f.state.values());
  Outcome outcome =
      FindLinearisation(f, row) ? LineariseElsewhere(f, row) : LineariseAt(f, row, roles);
  if (outcome == Outcome::kOutOfDomain || outcome == Outcome::kFailed) entry.h.clear();
  if (outcome == Outcome::kAccepted) outcome = NoiseAt(row, roles);
  if (outcome != Outcome::kAccepted) return outcome;
  if (geometry.kind == GeometryKind::kAngle) geometry.Normalise(entry.h.data());
  TakeInnovation(row);
  return outcome;
}

/// Puts where H is taken into at_: the roles in f.buffers.roles, but first estimates, and what the
/// measurement implies for the role that asks for it. Whether that is elsewhere than h.
bool Linear::FindLinearisation(const FilterState& f, const Row& row) {
  const std::vector<RoleBinding>& bound = row.binding->roles;
  at_.assign(f.buffers.roles.begin(), f.buffers.roles.end());
  implied_.clear();
  bool elsewhere = false;
  for (std::size_t i = 0; i < std::min(at_.size(), bound.size()); ++i) {
    const BlockId block = bound[i].block;
    if (block < 0 || at_[i] == nullptr) continue;
    const auto index = static_cast<std::size_t>(block);
    if (bound[i].jacobian_at == JacobianAt::kMeasurement) {
      implied_.resize(static_cast<std::size_t>(row.model->roles()[i].geometry.ambient));
      at_[i] = implied_.data();
    } else if (!f.first_estimates.empty() && !f.first_estimates[index].empty()) {
      at_[i] = f.first_estimates[index].data();
    }
    elsewhere = elsewhere || at_[i] != f.buffers.roles[i];
  }
  return elsewhere;
}

/// h at x, in f.buffers.roles, and H at at_.
Outcome Linear::LineariseElsewhere(FilterState& f, Row& row) {
  const SensorModel& model = *row.model;
  MeasurementReport& entry = *row.report;
  entry.h.assign(static_cast<std::size_t>(model.measurement().geometry.ambient), std::nan(""));
  Outcome outcome = PredictAt(f, row, f.state.values(), entry.h.data());
  if (outcome != Outcome::kAccepted) return outcome;
  if (!implied_.empty()) {
    const Status status =
        model.Initialise(f.buffers.roles.data(), entry.z.data(), implied_.data(), nullptr, nullptr);
    // What z cannot have come from tells nothing of where to linearise.
    outcome = status == Status::kOutOfDomain ? Outcome::kInvalid : OutcomeOf(status);
    if (outcome != Outcome::kAccepted) return outcome;
  }
  predicted_.assign(entry.h.begin(), entry.h.end());
  outcome = LineariseAt(f, row, at_.data());
  entry.h.assign(predicted_.begin(), predicted_.end());
  for (std::size_t i = 0; i < at_.size(); ++i) {
    const Geometry& geometry = model.roles()[i].geometry;
    if (row.place->columns[i] < 0 || at_[i] == f.buffers.roles[i] ||
        geometry.kind != GeometryKind::kUnitVector) {
      continue;
    }
    RowMajor j(geometry.tangent, geometry.tangent);
    geometry.Transport(f.buffers.roles[i], at_[i], j.data());
    ChainJacobian(f, row, row.place->columns[i], geometry.tangent, j.data());
  }
  return outcome;
}

void Linear::Project(FilterState& f, Row& row) {
  row.PHt.resize(static_cast<std::size_t>(f.size()) * static_cast<std::size_t>(row.report->dof));
  row.report->s.assign(row.R.begin(), row.R.end());
  f.state.covariance().Project(row.jacobian(), row.PHt.data(), row.report->s.data());
}

Outcome Linear::CorrectBy(FilterState& f, std::span<Row* const> rows, const double* dx) {
  const auto considers = [](const Row* row) {
    const std::vector<bool>& consider = row->place->consider;
    return std::ranges::find(consider, true) != consider.end();
  };
  const bool small = f.state.covariance().small() && CountOf(rows) <= Covariance::kSmall &&
                     !f.considering && std::ranges::none_of(rows, considers);
  const Outcome outcome = small ? CorrectSmall(f, rows, dx) : CorrectLarge(f, rows, dx);
  if (outcome == Outcome::kNotPd) {
    Note(f, "not_pd", "the update would leave S or P not positive definite; rolled back");
  } else if (outcome == Outcome::kNotFinite) {
    Note(f, "not_finite", "the update is not finite; rolled back");
  }
  return outcome;
}

/// Few states and few rows: nothing is allocated.
Outcome Linear::CorrectSmall(FilterState& f, std::span<Row* const> rows, const double* correction) {
  constexpr std::size_t kMost = Covariance::kSmall;
  std::array<double, kMost * kMost> pht, s, w, gain;
  std::array<double, kMost> innovation, inverse_d, dx;
  const auto n = static_cast<std::size_t>(f.size());
  const int m = static_cast<int>(CountOf(rows));
  const auto all = static_cast<std::size_t>(m);
  std::size_t at = 0;
  for (const Row* row : rows) {
    const MeasurementReport& entry = *row->report;
    const JacobianRows h = row->jacobian();
    const auto k = static_cast<std::size_t>(entry.dof);
    std::copy(row->PHt.begin(), row->PHt.end(), pht.begin() + at * n);
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
  Covariance& p = f.state.covariance();
  if (!p.Solve(m, pht.data(), s.data(), innovation.data(), w.data(), inverse_d.data(), dx.data(),
               gain.data())) {
    return Outcome::kNotPd;
  }
  if (correction != nullptr) std::copy_n(correction, n, dx.begin());
  if (!AllFinite({dx.data(), n})) return Outcome::kNotFinite;
  f.state.Retract(dx.data(), f.buffers.moved);
  if (!AllFinite(f.buffers.moved)) return Outcome::kNotFinite;
  if (!p.Downdate(m, w.data(), inverse_d.data())) return CorrectLarge(f, rows, correction);
  f.state.MoveTo(f.buffers.moved);  // last: P turns with the tangent planes
  f.RecordUpdate(rows, gain.data());
  return Outcome::kAccepted;
}

Outcome Linear::CorrectLarge(FilterState& f, std::span<Row* const> rows, const double* correction) {
  const Workspace::Use use(f.work);
  const Stacked all = Stack(f, rows);
  const Workspace::Matrix pht = ProjectionOf(f, rows);
  Eigen::MatrixXd s = all.noise;
  Eigen::Index at = 0;
  for (const Row* row : rows) {
    const Eigen::Index k = row->report->dof;
    for (const JacobianPart& part : row->place->parts) {
      s.middleRows(at, k) +=
          all.h.block(at, part.offset, k, part.size) * pht.middleRows(part.offset, part.size);
    }
    at += k;
  }
  if (!Factorise(s)) return Outcome::kNotPd;
  if (pht.rows() == 0) {  // nothing to correct, and Eigen solves for one column at least
    f.RecordUpdate(rows, nullptr);
    return Outcome::kAccepted;
  }
  const auto l = s.triangularView<Eigen::Lower>();
  const auto l_transposed = s.transpose().triangularView<Eigen::Upper>();
  const Eigen::MatrixXd w = l.solve(pht.transpose()).transpose();
  Eigen::MatrixXd gain = l_transposed.solve(w.transpose()).transpose();
  Eigen::MatrixXd lost = MaskConsidered(f, rows, gain);
  if (lost.size() > 0) lost *= l;
  Eigen::VectorXd dx = gain * all.innovation;
  if (correction != nullptr) std::copy_n(correction, dx.size(), dx.data());
  f.state.Retract(dx.data(), f.buffers.moved);
  if (!AllFinite(f.buffers.moved) || !w.allFinite() || !gain.allFinite())
    return Outcome::kNotFinite;
  if (!Update(f.state.covariance(), w, lost, gain, all)) return Outcome::kNotPd;
  f.state.MoveTo(f.buffers.moved);
  f.RecordUpdate(rows, gain.data());
  return Outcome::kAccepted;
}

}  // namespace alidade::internal
