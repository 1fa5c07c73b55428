// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/linear.h"

#include <algorithm>
#include <array>

#include "alidade/base/all_finite.h"
#include "alidade/estimation/ekf.h"
#include "alidade/state/projection.h"
#include "alidade/state/small_kernels.h"
#include "alidade/state/tiles.h"

namespace alidade::internal {
namespace {

/// The variances of P - W W' + E E', in place of the squared norms of the rows of W; E has the
/// given rows.
void TakeVariancesAfter(const Covariance& p, std::span<const int> rows, const Workspace::Matrix& e,
                        Workspace::Vector& left) {
  for (int i = 0; i < p.size(); ++i) left[i] = p.Variance(i) - left[i];
  for (std::size_t i = 0; i < rows.size(); ++i) {
    left[rows[i]] += e.row(static_cast<Eigen::Index>(i)).squaredNorm();
  }
}

/// Whether one of them has nearly no digits left of that of P.
bool Cancels(const Covariance& p, const Workspace::Vector& left) {
  for (int i = 0; i < p.size(); ++i) {
    if (left[i] < kCancelled * p.Variance(i)) return true;
  }
  return false;
}

}  // namespace

Trouble Linear::Step(FilterState& f, double dt_s) {
  if (Trouble trouble = f.motions.Evaluate(f.state, dt_s)) return trouble;
  if (f.motions.Apply(f.state)) return {};
  return {"not_finite", "the covariance steps to what is not finite"};
}

Outcome Linear::Predict(FilterState& f, Row& row) {
  const Outcome outcome = Linearise(f, row);
  if (outcome == Outcome::kAccepted) TakeS(f, row);
  return outcome;
}

Outcome Linear::Linearise(FilterState& f, Row& row) {
  MeasurementReport& entry = *row.report;
  RolesAt(f, row, f.state.values());
  Outcome outcome =
      FindLinearisation(f, row) ? LineariseElsewhere(f, row) : LineariseAt(row, row.roles.data());
  if (outcome == Outcome::kOutOfDomain || outcome == Outcome::kFailed) entry.h.clear();
  if (outcome == Outcome::kAccepted) outcome = NoiseAt(row, row.roles.data());
  if (outcome != Outcome::kAccepted) {
    NoteRefusal(f, row, outcome);
    return outcome;
  }
  WrapAngles(row.model->measurement().geometry, entry.h.data());
  TakeInnovation(row);
  return outcome;
}

/// Puts where H is taken into at_: the roles in row.roles, but first estimates, and what the
/// measurement implies for the role that asks for it. Whether that is elsewhere than h.
bool Linear::FindLinearisation(const FilterState& f, const Row& row) {
  const std::vector<RoleBinding>& bound = row.binding->roles;
  at_.assign(row.roles.begin(), row.roles.end());
  implied_.clear();
  bool elsewhere = false;
  for (std::size_t i = 0; i < std::min(at_.size(), bound.size()); ++i) {
    const BlockId block = bound[i].block;
    if (block < 0 || at_[i] == nullptr) continue;
    const auto index = static_cast<std::size_t>(block);
    if (bound[i].jacobian_at == JacobianAt::kMeasurement) {
      implied_.resize(static_cast<std::size_t>(row.model->roles()[i].geometry.ambient));
      at_[i] = implied_.data();
    } else if (!f.first_estimates[index].empty()) {
      at_[i] = f.first_estimates[index].data();
    }
    elsewhere = elsewhere || at_[i] != row.roles[i];
  }
  return elsewhere;
}

/// h at row.roles, H at at_.
Outcome Linear::LineariseElsewhere(FilterState& f, Row& row) {
  const SensorModel& model = *row.model;
  MeasurementReport& entry = *row.report;
  entry.h.resize(static_cast<std::size_t>(model.measurement().geometry.ambient));
  Outcome outcome = PredictAt(f, row, f.state.values(), entry.h.data());
  if (outcome != Outcome::kAccepted) return outcome;
  if (!implied_.empty()) {
    const Status status =
        model.Initialise(row.roles.data(), {entry.z.data(), row.measurement->known.data()}, nullptr,
                         {.y = implied_.data()});
    // What z cannot have come from tells nothing of where to linearise.
    outcome = status == Status::kOutOfDomain ? Outcome::kInvalid : OutcomeOf(status);
    if (outcome != Outcome::kAccepted) return outcome;
  }
  outcome = EvaluateAt(model, *row.place, *row.measurement, at_.data(), row.memory.columns,
                       h_there_, &row.H);
  if (outcome != Outcome::kAccepted) return outcome;
  for (std::size_t i = 0; i < at_.size(); ++i) {
    const Geometry& geometry = model.roles()[i].geometry;
    if (row.place->columns[i] < 0 || at_[i] == row.roles[i] ||
        geometry.kind != GeometryKind::kUnitVector) {
      continue;
    }
    std::array<double, 4> j;  // a unit vector's tangent has two elements
    geometry.Transport(row.roles[i], at_[i], j.data());
    ChainJacobian(row, row.place->columns[i], geometry.tangent, j.data(), f.work);
  }
  return outcome;
}

void Linear::TakeS(const FilterState& f, Row& row) {
  row.report->s.assign(row.R.begin(), row.R.end());
  AddProjection(f.state.covariance(), row.jacobian(), row.report->s.data());
}

Outcome Linear::CorrectBy(FilterState& f, std::span<Row* const> rows, const double* dx) {
  const auto considers = [](const Row* row) {
    const std::vector<bool>& consider = row->place->consider;
    return std::ranges::find(consider, true) != consider.end();
  };
  const bool small = IsSmall(f.state.covariance()) && TotalDof(rows) <= kSmall &&
                     !f.blocks.considering && std::ranges::none_of(rows, considers);
  return small ? CorrectSmall(f, rows, dx) : CorrectLarge(f, rows, dx);
}

/// Few states and few rows, in arrays: CorrectLarge takes longer there, and is what is left where
/// digits of P would cancel.
Outcome Linear::CorrectSmall(FilterState& f, std::span<Row* const> rows, const double* correction) {
  constexpr std::size_t kMost = kSmall;
  std::array<double, kMost * kMost> pht, hpht, s, w, gain;
  std::array<double, kMost> innovation, inverse_d, dx;
  const auto n = static_cast<std::size_t>(f.size());
  const int m = static_cast<int>(TotalDof(rows));
  const auto all = static_cast<std::size_t>(m);
  std::size_t at = 0;
  for (const Row* row : rows) {
    const MeasurementReport& entry = *row->report;
    const JacobianRows h = row->jacobian();
    const auto k = static_cast<std::size_t>(entry.dof);
    std::copy(entry.innovation.begin(), entry.innovation.end(), innovation.begin() + at);
    std::fill_n(hpht.begin(), k * k, 0.0);  // not wanted: the report has S
    Project(f.state.covariance(), h, pht.data() + at * n, hpht.data());
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
  const SmallKernels& kernels = SmallKernelsFor(f.size());
  if (!kernels.solve(m, pht.data(), s.data(), m, innovation.data(), w.data(), inverse_d.data(),
                     dx.data(), gain.data())) {
    return Outcome::kNotPd;
  }
  if (correction != nullptr) std::copy_n(correction, n, dx.begin());
  if (!AllFinite({dx.data(), n})) return Outcome::kNotFinite;
  f.state.Retract(dx.data(), f.moved);
  if (!AllFinite(f.moved)) return Outcome::kNotFinite;
  LowerTriangle p = f.state.covariance().lower();
  if (!kernels.downdate(p.data(), static_cast<int>(p.outerStride()), m, w.data(),
                        inverse_d.data())) {
    return CorrectLarge(f, rows, correction);
  }
  f.state.MoveTo(f.moved);  // last: P turns with the tangent planes
  RecordGain(f, rows, gain.data());
  return Outcome::kAccepted;
}

/// The rows of P that are considered, in lost_. There the optimal gain is K* = W L^-1, and K is it
/// with zeros for what is considered.
Linear::Lost Linear::FindLost(FilterState& f, std::span<Row* const> rows, const Panels& w,
                              const Workspace::Matrix& l) {
  lost_.clear();
  ForEachConsidered(f, rows, [&](int offset, int size, Eigen::Index, Eigen::Index) {
    for (int i = 0; i < size; ++i) lost_.push_back(offset + i);
  });
  std::ranges::sort(lost_);
  lost_.erase(std::unique(lost_.begin(), lost_.end()), lost_.end());
  const Eigen::Index count = std::ssize(lost_), m = w.columns;
  Lost lost{f.work.Take(count, m), f.work.Take(count, m)};
  Workspace::Matrix &gain = lost.gain, &e = lost.e;
  if (count == 0) return lost;
  e.setZero();
  for (Eigen::Index k = 0; k < m; ++k) {
    for (Eigen::Index i = 0; i < count; ++i) gain(i, k) = w(lost_[static_cast<std::size_t>(i)], k);
  }
  Divide(l, gain);
  ForEachConsidered(f, rows, [&](int offset, int size, Eigen::Index at, Eigen::Index k) {
    const Eigen::Index i = std::ranges::lower_bound(lost_, offset) - lost_.begin();
    e.block(i, at, size, k) -= gain.block(i, at, size, k);
    gain.block(i, at, size, k).setZero();
  });
  for (Eigen::Index k = 0; k < m; ++k) {
    e.col(k) *= l(k, k);
    e.col(k).noalias() += e.rightCols(m - k - 1) * l.col(k).tail(m - k - 1);
  }
  return lost;
}

Outcome Linear::CorrectLarge(FilterState& f, std::span<Row* const> rows, const double* correction) {
  const Workspace::Use use(f.work);
  Covariance& p = f.state.covariance();
  const Workspace::Vector innovation = InnovationOf(f, rows);
  const Panels w = ProjectionOf(f, rows);
  Workspace::Matrix l = NoiseOf(f, rows);
  const Eigen::Index n = w.rows, m = w.columns;
  Workspace::Matrix gain = f.work.Take(n, m);
  Workspace::Vector y = f.work.Take(m), dx = f.work.Take(n), left = f.work.Take(n);
  AddProjected(f, w, l);
  if (!Factorise(l)) return Outcome::kNotPd;
  if (n == 0) return Outcome::kAccepted;  // nothing to correct
  DivideByTransposed(l, w);
  const auto [lost_gain, e] = FindLost(f, rows, w, l);
  y = innovation;
  l.triangularView<Eigen::Lower>().solveInPlace(y);
  Multiply(w, y, dx, left.data());
  for (std::size_t i = 0; i < lost_.size(); ++i) {
    dx[lost_[i]] = lost_gain.row(static_cast<Eigen::Index>(i)).dot(innovation);
  }
  if (correction != nullptr) std::copy_n(correction, n, dx.data());
  f.state.Retract(dx.data(), f.moved);
  TakeVariancesAfter(p, lost_, e, left);
  if (!AllFinite(f.moved) || !left.allFinite()) return Outcome::kNotFinite;
  const bool cancels = Cancels(p, left);
  const bool recorded =
      std::ranges::any_of(rows, [](const Row* row) { return GainIsRecorded(*row); });
  if (cancels || recorded) {
    Copy(w, gain);
    Divide(l, gain);
    for (std::size_t i = 0; i < lost_.size(); ++i) {
      gain.row(lost_[i]) = lost_gain.row(static_cast<Eigen::Index>(i));
    }
  }
  if (cancels) {
    const bool left_psd = Joseph(p.lower(), gain, JacobianOf(f, rows), NoiseOf(f, rows), f.work);
    if (!left_psd) return Outcome::kNotPd;
  } else {
    SubtractOuterProduct(p.lower(), w);
    AddOuterProduct(p.lower(), lost_, e);
  }
  f.state.MoveTo(f.moved);
  if (recorded) RecordGain(f, rows, gain.data());
  return Outcome::kAccepted;
}

}  // namespace alidade::internal

namespace alidade {

Ekf::Ekf(System system, const EkfOptions& options, const std::vector<StreamInfo>& streams)
    : Filter(std::move(system), options, streams, std::make_unique<internal::Linear>()) {}

}  // namespace alidade
