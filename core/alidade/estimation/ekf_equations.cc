// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/ekf_equations.h"

#include <algorithm>
#include <array>
#include <optional>

#include "alidade/base/all_finite.h"
#include "alidade/estimation/stacked_measurements.h"
#include "alidade/state/tiles.h"

namespace alidade::internal {

// Flattened functions here: see FilterEngine::Run.

[[gnu::flatten]] StepError EkfEquations::Step(FilterState& f, double dt_s) {
  if (StepError error = f.motions.Evaluate(f.state, dt_s)) return error;
  return f.motions.Apply(f.state);
}

void EkfEquations::BeginUpdate(FilterState& f, int capacity) {
  f.update.Begin(f.state.covariance(), capacity);
}

[[gnu::flatten]] Outcome EkfEquations::Predict(FilterState& f, PendingMeasurement& pending) {
  const double* const* const roles = RolesAt(f, pending, f.state.values());
  const bool elsewhere =
      (pending.place->elsewhere || f.keeps_first_estimates()) && FindLinearisation(f, pending);
  const Outcome outcome = elsewhere ? LineariseElsewhere(f, pending) : LineariseAt(pending, roles);
  if (outcome != Outcome::kAccepted) {
    if (outcome == Outcome::kOutOfDomain || outcome == Outcome::kFailed) pending.report->h = {};
    NoteRefusal(f, pending, outcome);
    return outcome;
  }
  WrapAngles(pending.model->measurement().geometry, pending.h);
  ComputeInnovation(pending);
  return outcome;
}

/// Puts where H is taken into at_: the roles in row.roles, but first estimates, and what the
/// measurement implies for the role that asks for it. Whether that is elsewhere than h.
[[gnu::noinline]] bool EkfEquations::FindLinearisation(const FilterState& f,
                                                       const PendingMeasurement& pending) {
  const std::vector<RoleBinding>& bound = pending.binding->roles;
  at_ = pending.roles;
  implied_.clear();
  bool elsewhere = false;
  for (std::size_t i = 0; i < bound.size(); ++i) {
    const BlockId block = bound[i].block;
    if (block < 0 || at_[i] == nullptr) continue;
    const auto index = static_cast<std::size_t>(block);
    if (bound[i].jacobian_at == JacobianAt::kMeasurement) {
      implied_.resize(static_cast<std::size_t>(pending.model->roles()[i].geometry.ambient));
      at_[i] = implied_.data();
    } else if (!f.first_estimates[index].empty()) {
      at_[i] = f.first_estimates[index].data();
    }
    elsewhere = elsewhere || at_[i] != pending.roles[i];
  }
  return elsewhere;
}

/// h at row.roles, H at at_.
[[gnu::noinline]] Outcome EkfEquations::LineariseElsewhere(FilterState& f,
                                                           PendingMeasurement& pending) {
  const SensorModel& model = *pending.model;
  pending.report->h = {pending.h, static_cast<std::size_t>(pending.place->ambient)};
  Outcome outcome = PredictAt(f, pending, f.state.values(), pending.h);
  if (outcome != Outcome::kAccepted) return outcome;
  if (!implied_.empty()) {
    const Status status =
        model.Initialise(pending.roles.data(), {pending.z, pending.measurement->known.data()},
                         nullptr, {.y = implied_.data()});
    // What z cannot have come from tells nothing of where to linearise.
    outcome = status == Status::kOutOfDomain ? Outcome::kInvalid : OutcomeOf(status);
    if (outcome != Outcome::kAccepted) return outcome;
  }
  const SensorPlace& place = *pending.place;
  h_there_.resize(static_cast<std::size_t>(place.ambient));
  outcome = EvaluateAt(model, place, *pending.measurement, at_.data(),
                       {h_there_.data(), pending.H.data()});
  if (outcome == Outcome::kAccepted) outcome = NoiseAt(pending, pending.roles.data());
  if (outcome != Outcome::kAccepted) return outcome;
  for (std::size_t i = 0; i < place.values.size(); ++i) {
    const Geometry& geometry = model.roles()[i].geometry;
    if (place.columns[i] < 0 || at_[i] == pending.roles[i] ||
        geometry.kind != GeometryKind::kUnitVector) {
      continue;
    }
    std::array<double, 4> j;  // a unit vector's tangent has two elements
    geometry.Transport(pending.roles[i], at_[i], j.data());
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
    MeasurementRows& one = pending->linearised;
    if (one.column != column) f.update.MoveColumns(one.column, column, one.h.rows);
    one.column = column;
    stacked_.push_back(&one);
    column += one.h.rows;
  }
}

/// The rows of P that are considered, in considered_.
[[gnu::noinline]] void EkfEquations::FindConsidered(const FilterState& f,
                                                    std::span<PendingMeasurement* const> rows) {
  ForEachConsidered(f, rows, [&](int offset, int size, int, int) {
    for (int i = 0; i < size; ++i) considered_.push_back(offset + i);
  });
  std::ranges::sort(considered_);
  considered_.erase(std::unique(considered_.begin(), considered_.end()), considered_.end());
}

/// K is K* with zeros for what is considered: takes it, and its dx, into the update.
[[gnu::noinline]] EkfEquations::Considered EkfEquations::ConsiderCorrection(
    FilterState& f, std::span<PendingMeasurement* const> rows, bool recorded) {
  const Eigen::Index count = std::ssize(considered_), m = f.update.rows();
  Considered found{f.work.Take(count, m), f.work.Take(count, m)};
  Workspace::Matrix &gain = found.gain, &e = found.e, l = f.work.Take(m, m);
  f.update.CopyFactor(l);
  for (Eigen::Index k = 0; k < m; ++k) {
    for (Eigen::Index i = 0; i < count; ++i) {
      gain(i, k) =
          f.update.w(considered_[static_cast<std::size_t>(i)], static_cast<int>(k)) / l(k, k);
    }
  }
  Divide(l, gain);
  e.setZero();
  ForEachConsidered(f, rows, [&](int offset, int size, int at, int k) {
    const Eigen::Index i = std::ranges::lower_bound(considered_, offset) - considered_.begin();
    e.block(i, at, size, k) -= gain.block(i, at, size, k);
    gain.block(i, at, size, k).setZero();
  });
  for (Eigen::Index k = 0; k < m; ++k) {
    e.col(k) *= l(k, k);
    e.col(k).noalias() += e.rightCols(m - k - 1) * l.col(k).tail(m - k - 1);
  }
  const Workspace::Vector innovation = InnovationOf(f, rows);
  for (Eigen::Index i = 0; i < count; ++i) {
    const int row = considered_[static_cast<std::size_t>(i)];
    f.update.dx()[row] = gain.row(i).dot(innovation);
    for (int k = 0; recorded && k < m; ++k) f.update.gain(row, k) = gain(i, k);
  }
  return found;
}

/// P by any gain, that of considered rows as given, without a difference that would cancel. False
/// where a variance would be negative.
[[gnu::noinline]] bool EkfEquations::Joseph(FilterState& f,
                                            std::span<PendingMeasurement* const> rows,
                                            const Workspace::Matrix* considered) {
  const Eigen::Index n = f.size(), m = f.update.rows();
  Workspace::Matrix gain = f.work.Take(n, m), l = f.work.Take(m, m);
  f.update.CopyFactor(l);
  f.update.CopyColumns(0, gain);
  for (Eigen::Index k = 0; k < m; ++k) gain.col(k) /= l(k, k);
  Divide(l, gain);
  for (std::size_t i = 0; i < considered_.size(); ++i) {
    gain.row(considered_[i]) = considered->row(static_cast<Eigen::Index>(i));
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
  std::optional<Considered> considered;
  considered_.clear();
  if (f.blocks.considering || f.problem_index->considers) FindConsidered(f, rows);
  if (!considered_.empty()) considered = ConsiderCorrection(f, rows, recorded);
  if (!f.state.Retract(correction != nullptr ? correction : update.dx(), f.moved)) {
    return Outcome::kNotFinite;
  }
  if (solution == Solution::kCancellation) {
    if (!Joseph(f, rows, considered ? &considered->gain : nullptr)) return Outcome::kNotPd;
  } else {
    update.Downdate();
    if (considered) {
      AddOuterProduct(f.state.covariance().lower(), considered_, considered->e);
    }
  }
  f.state.MoveTo(f.moved);  // last: P turns with the tangent planes
  if (recorded) {
    RecordGainBy(f, rows, [&](std::span<const int> kept, int column, int count, double* to) {
      update.CopyGain(kept, column, count, to);
    });
  }
  return Outcome::kAccepted;
}

}  // namespace alidade::internal
