// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/ekf_equations.h"

#include <algorithm>
#include <array>
#include <optional>

#include "alidade/base/all_finite.h"
#include "alidade/estimation/digits_lost.h"
#include "alidade/estimation/stacked_measurements.h"
#include "alidade/state/tiles.h"

namespace alidade::internal {

// Some functions have the attribute flatten. FilterEngine::Run documents the reason.

[[gnu::flatten]] StepError EkfEquations::Step(FilterState& f, double dt_s) {
  if (StepError error = f.motions.Evaluate(f.state, dt_s)) return error;
  return f.motions.Apply(f.state);
}

void EkfEquations::BeginUpdate(FilterState& f, int capacity) {
  f.update.Begin(f.state.covariance(), capacity);
}

[[gnu::flatten]] Outcome EkfEquations::Predict(FilterState& f, PendingMeasurement& pending) {
  const double* const* const roles = RolesAt(f, pending, f.state.values());
  const bool has_jacobian_point =
      (pending.place->linearises_at_measurement || f.uses_first_estimates()) &&
      FindLinearisation(f, pending);
  const Outcome outcome =
      has_jacobian_point ? LineariseSeparately(f, pending) : LineariseAt(pending, roles);
  if (outcome != Outcome::kAccepted) {
    if (outcome == Outcome::kOutOfDomain || outcome == Outcome::kFailed) pending.report->h = {};
    ReportRefusal(f, pending, outcome);
    return outcome;
  }
  WrapAngles(pending.model->measurement().geometry, pending.h);
  ComputeInnovation(pending);
  return outcome;
}

/// Sets jacobian_roles_, the values of the roles at which H is evaluated. If first estimates are
/// used, they replace the values of the roles. With `jacobian_at: measurement`, the value that z
/// implies replaces the value of the role. Returns whether H and h are evaluated at different
/// points.
[[gnu::noinline]] bool EkfEquations::FindLinearisation(const FilterState& f,
                                                       const PendingMeasurement& pending) {
  const std::vector<RoleBinding>& bound = pending.binding->roles;
  jacobian_roles_ = pending.roles;
  implied_value_.clear();
  bool differs = false;
  for (std::size_t i = 0; i < bound.size(); ++i) {
    const BlockId block = bound[i].block;
    if (block < 0 || jacobian_roles_[i] == nullptr) continue;
    const auto index = static_cast<std::size_t>(block);
    if (bound[i].jacobian_at == JacobianAt::kMeasurement) {
      implied_value_.resize(static_cast<std::size_t>(pending.model->roles()[i].geometry.ambient));
      jacobian_roles_[i] = implied_value_.data();
    } else if (!f.first_estimates[index].empty()) {
      jacobian_roles_[i] = f.first_estimates[index].data();
    }
    differs = differs || jacobian_roles_[i] != pending.roles[i];
  }
  return differs;
}

/// Computes h at the values of the roles, and H at jacobian_roles_.
[[gnu::noinline]] Outcome EkfEquations::LineariseSeparately(FilterState& f,
                                                            PendingMeasurement& pending) {
  const SensorModel& model = *pending.model;
  pending.report->h = {pending.h, static_cast<std::size_t>(pending.place->ambient)};
  Outcome outcome = PredictAt(f, pending, f.state.values(), pending.h);
  if (outcome != Outcome::kAccepted) return outcome;
  if (!implied_value_.empty()) {
    const Status status =
        model.Initialise(pending.roles.data(), {pending.z, pending.measurement->known.data()},
                         nullptr, {.y = implied_value_.data()});
    // If no value of the role explains z, the measurement is invalid.
    outcome = status == Status::kOutOfDomain ? Outcome::kInvalid : OutcomeOf(status);
    if (outcome != Outcome::kAccepted) return outcome;
  }
  const SensorPlace& place = *pending.place;
  jacobian_h_.resize(static_cast<std::size_t>(place.ambient));
  outcome = EvaluateAt(model, place, *pending.measurement, jacobian_roles_.data(),
                       {jacobian_h_.data(), pending.H.data()});
  if (outcome == Outcome::kAccepted) outcome = NoiseAt(pending, pending.roles.data());
  if (outcome != Outcome::kAccepted) return outcome;
  for (std::size_t i = 0; i < place.values.size(); ++i) {
    const Geometry& geometry = model.roles()[i].geometry;
    if (place.columns[i] < 0 || jacobian_roles_[i] == pending.roles[i] ||
        !geometry.has_transport()) {
      continue;
    }
    std::array<double, detail::kMaxTangent * detail::kMaxTangent> j;
    geometry.Transport(pending.roles[i], jacobian_roles_[i], j.data());
    ChainJacobian(pending, place.columns[i], geometry.tangent, j.data(), f.work);
  }
  return outcome;
}

double EkfEquations::ComputeNis(FilterState& f, PendingMeasurement& pending) {
  pending.report->s = {pending.s, pending.R.size()};
  return f.update.ComputeNis(pending.linearised);
}

void EkfEquations::AssignColumns(FilterState& f, std::span<PendingMeasurement* const> rows) {
  stacked_.clear();
  int column = 0;
  for (PendingMeasurement* const pending : rows) {
    MeasurementRows& linearised = pending->linearised;
    if (linearised.column != column) {
      f.update.MoveColumns(linearised.column, column, linearised.h.rows);
    }
    linearised.column = column;
    stacked_.push_back(&linearised);
    column += linearised.h.rows;
  }
}

/// Writes the rows of P that belong to consider states to consider_rows_.
[[gnu::noinline]] void EkfEquations::FindConsiderRows(const FilterState& f,
                                                      std::span<PendingMeasurement* const> rows) {
  ForEachConsidered(f, rows, [&](int offset, int size, int, int) {
    for (int i = 0; i < size; ++i) consider_rows_.push_back(offset + i);
  });
  std::ranges::sort(consider_rows_);
  consider_rows_.erase(std::unique(consider_rows_.begin(), consider_rows_.end()),
                       consider_rows_.end());
}

/// Computes the gain of the rows consider_rows_. The gain equals K*, but is zero for the
/// measurements whose sensor treats the row as a consider state. Writes the gain and the resulting
/// dx to f.update.
[[gnu::noinline]] EkfEquations::ConsiderGain EkfEquations::ConsiderCorrection(
    FilterState& f, std::span<PendingMeasurement* const> rows, bool recorded) {
  const Eigen::Index count = std::ssize(consider_rows_), m = f.update.rows();
  ConsiderGain result{f.work.Take(count, m), f.work.Take(count, m)};
  Workspace::Matrix &gain = result.gain, &e = result.e, l = f.work.Take(m, m);
  f.update.CopyFactor(l);
  for (Eigen::Index k = 0; k < m; ++k) {
    for (Eigen::Index i = 0; i < count; ++i) {
      gain(i, k) =
          f.update.w(consider_rows_[static_cast<std::size_t>(i)], static_cast<int>(k)) / l(k, k);
    }
  }
  Divide(l, gain);
  e.setZero();
  ForEachConsidered(f, rows, [&](int offset, int size, int column, int width) {
    const Eigen::Index i =
        std::ranges::lower_bound(consider_rows_, offset) - consider_rows_.begin();
    e.block(i, column, size, width) -= gain.block(i, column, size, width);
    gain.block(i, column, size, width).setZero();
  });
  for (Eigen::Index k = 0; k < m; ++k) {
    e.col(k) *= l(k, k);
    e.col(k).noalias() += e.rightCols(m - k - 1) * l.col(k).tail(m - k - 1);
  }
  const Workspace::Vector innovation = InnovationOf(f, rows);
  for (Eigen::Index i = 0; i < count; ++i) {
    const int row = consider_rows_[static_cast<std::size_t>(i)];
    f.update.dx()[row] = gain.row(i).dot(innovation);
    for (int k = 0; recorded && k < m; ++k) f.update.gain(row, k) = gain(i, k);
  }
  return result;
}

/// Updates P by the Joseph form, which does not lose digits by cancellation. `consider_gain` is the
/// gain of the rows consider_rows_; it may be null if there are no such rows. Returns false if a
/// variance would be negative.
[[gnu::noinline]] bool EkfEquations::Joseph(FilterState& f,
                                            std::span<PendingMeasurement* const> rows,
                                            const Workspace::Matrix* consider_gain) {
  const Eigen::Index n = f.size(), m = f.update.rows();
  Workspace::Matrix gain = f.work.Take(n, m), l = f.work.Take(m, m);
  f.update.CopyFactor(l);
  f.update.CopyColumns(0, gain);
  for (Eigen::Index k = 0; k < m; ++k) gain.col(k) /= l(k, k);
  Divide(l, gain);
  for (std::size_t i = 0; i < consider_rows_.size(); ++i) {
    gain.row(consider_rows_[i]) = consider_gain->row(static_cast<Eigen::Index>(i));
  }
  return internal::Joseph(f.state.covariance().lower(), gain, JacobianOf(f, rows), NoiseOf(f, rows),
                          f.work);
}

[[gnu::flatten]] Outcome EkfEquations::CorrectBy(FilterState& f,
                                                 std::span<PendingMeasurement* const> rows,
                                                 const double* correction) {
  const Workspace::Use use(f.work);
  KalmanUpdate& update = f.update;
  AssignColumns(f, rows);
  const bool recorded = std::ranges::any_of(
      rows, [](const PendingMeasurement* pending) { return GainIsRecorded(*pending); });
  const Solution solution = update.Solve(stacked_, recorded);
  if (solution == Solution::kNotPositiveDefinite) return Outcome::kNotPd;
  if (solution == Solution::kNotFinite) return Outcome::kNotFinite;
  std::optional<ConsiderGain> consider_gain;
  consider_rows_.clear();
  if (f.blocks.has_consider || f.problem_index->has_consider) FindConsiderRows(f, rows);
  if (!consider_rows_.empty()) consider_gain = ConsiderCorrection(f, rows, recorded);
  if (!f.state.Retract(correction != nullptr ? correction : update.dx(), f.moved)) {
    return Outcome::kNotFinite;
  }
  if (solution == Solution::kCancellation) {
    if (!Joseph(f, rows, consider_gain ? &consider_gain->gain : nullptr)) return Outcome::kNotPd;
  } else {
    update.Downdate();
    if (consider_gain) {
      AddOuterProduct(f.state.covariance().lower(), consider_rows_, consider_gain->e);
    }
  }
  for (const PendingMeasurement* const pending : rows) {
    CheckDigits(f, *pending, update.inverse_d() + pending->linearised.column);
  }
  f.state.MoveTo(f.moved);  // must come last, because MoveTo also transports P
  if (recorded) {
    RecordGainBy(f, rows,
                 [&](std::span<const int> p_rows, int column, int count, double* destination) {
                   update.CopyGain(p_rows, column, count, destination);
                 });
  }
  return Outcome::kAccepted;
}

}  // namespace alidade::internal
