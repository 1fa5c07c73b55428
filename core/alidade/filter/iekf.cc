// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/iekf.h"

#include <algorithm>
#include <cmath>

#include "alidade/base/number_text.h"
#include "alidade/filter/factorise.h"

namespace alidade {
namespace {

/// r' R^-1 r for R = L L', L the lower triangle of `l`; r becomes L^-1 r.
double SquaredNorm(const Workspace::Matrix& l, Workspace::Vector& r) {
  l.triangularView<Eigen::Lower>().solveInPlace(r);
  return r.squaredNorm();
}

}  // namespace

Iekf::Iekf(System system, const IekfOptions& options, const std::vector<StreamInfo>& streams)
    : Ekf(std::move(system), options, streams, Steps::kOverridden),
      max_iterations_(options.max_iterations),
      tolerance_(options.tolerance) {
  ALIDADE_EXPECTS(options.jacobian == JacobianPolicy::kLatest);
  ALIDADE_EXPECTS(max_iterations_ > 1 && tolerance_ > 0.0);
  ALIDADE_EXPECTS(!FindUnsupported(system_, kSupport));
}

Outcome Iekf::Apply(std::span<Row* const> rows) {
  const Workspace::Use use(work_);
  if (at_prediction_.size() < rows.size()) at_prediction_.resize(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) at_prediction_[i] = EntryOf(*rows[i]);
  const std::optional<Minimum> minimum = Minimise(rows);
  if (minimum) correction_ = minimum->dx.data();
  const Outcome outcome = Ekf::Apply(rows);
  correction_ = nullptr;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    MeasurementReport& entry = EntryOf(*rows[i]);
    entry.h.swap(at_prediction_[i].h);
    entry.innovation.swap(at_prediction_[i].innovation);
    entry.s.swap(at_prediction_[i].s);
  }
  if (outcome == Outcome::kAccepted && minimum && !minimum->converged) {
    Note("not_converged",
         "an update stopped after " + std::to_string(minimum->iterations) + " iterations" +
             (minimum->step ? ", a step of " + internal::RoundedText(*minimum->step, 3) +
                                  " sigma before its optimum"
                            : std::string(" where h has no Jacobian")) +
             "; the last iterate is kept");
  }
  return outcome;
}

/// The optimum of one update, or the last iterate on the way, which the rows are then linearised
/// at, or at the one before where they cannot be. P may be singular: dx = P v all the way, so that
/// dx' P^-1 dx = v' dx. Nothing, and the rows as they were, where there is no first step.
std::optional<Iekf::Minimum> Iekf::Minimise(std::span<Row* const> rows) {
  const Eigen::Index n = state_.covariance().size();
  Eigen::Index m = 0;
  for (const Row* row : rows) m += EntryOf(*row).dof;
  Minimum minimum{work_.Take(n)};
  Workspace::Vector& dx = minimum.dx;
  Workspace::Vector v = work_.Take(n), step = work_.Take(n), step_v = work_.Take(n);
  Workspace::Vector y = work_.Take(m), residual = work_.Take(m);
  Workspace::Vector linearised = work_.Take(n);  // where the rows last were
  Workspace::Matrix s = work_.Take(m, m), r = work_.Take(m, m);
  dx.setZero();
  v.setZero();
  linearised.setZero();
  for (bool defined = true;; defined = Relinearise(rows, dx.data())) {
    const Workspace::Use use(work_);
    const Stacked at = Stack(rows);
    const Workspace::Matrix pht = ProjectionOf(rows);
    s = r = at.noise;
    s.noalias() += at.h * pht;
    if (!defined || !internal::Factorise(s) || !internal::Factorise(r)) {
      if (minimum.iterations == 0) return std::nullopt;
      MoveTo(linearised.data());
      Relinearise(rows, linearised.data());
      minimum.step.reset();
      break;
    }
    linearised = dx;
    ++minimum.iterations;
    y = at.innovation;
    y.noalias() += at.h * dx;
    s.triangularView<Eigen::Lower>().solveInPlace(y);
    s.triangularView<Eigen::Lower>().transpose().solveInPlace(y);
    step = -dx;
    step.noalias() += pht * y;
    step_v = -v;
    step_v.noalias() += at.h.transpose() * y;
    residual.noalias() = at.h * step;
    minimum.step = std::sqrt(step_v.dot(step) + SquaredNorm(r, residual));
    if (*minimum.step <= tolerance_) {
      dx += step;
      minimum.converged = true;
      break;
    }
    if (minimum.iterations == max_iterations_) break;
    residual = at.innovation;
    const double part = PartThatLowersTheCost(rows, {dx, v, step, step_v}, r, residual);
    if (part == 0.0) break;
    dx += part * step;
    v += part * step_v;
  }
  return minimum;
}

/// The largest of 1, 1/2, 1/4, ... of the step with which v' dx + r' R^-1 r does not rise, but for
/// what rounding makes of it; 0 where there is none. `r` is the factor of R, `residual` the
/// innovations at dx, then memory.
double Iekf::PartThatLowersTheCost(std::span<Row* const> rows, const Direction& at,
                                   const Workspace::Matrix& r, Workspace::Vector& residual) {
  constexpr double kRounding = 1e-12;
  constexpr int kHalvings = 10;
  const Workspace::Use use(work_);
  Workspace::Vector there = work_.Take(at.dx.size());
  const double cost = (at.v.dot(at.dx) + SquaredNorm(r, residual)) * (1.0 + kRounding);
  for (int halvings = 0; halvings <= kHalvings; ++halvings) {
    const double part = std::ldexp(1.0, -halvings);
    there = at.dx + part * at.step;
    if (MoveTo(there.data()) && Innovations(rows, residual) &&
        (at.v + part * at.step_v).dot(there) + SquaredNorm(r, residual) <= cost) {
      return part;
    }
  }
  return 0.0;
}

/// Puts the iterate at prior (+) dx. False where that is not finite.
bool Iekf::MoveTo(const double* dx) {
  state_.Retract(dx, iterate_);
  return AllFinite(iterate_);
}

/// z (-) h at the iterate, of all rows; false where one is not defined or not finite.
bool Iekf::Innovations(std::span<Row* const> rows, Workspace::Vector& innovations) {
  Eigen::Index at = 0;
  for (Row* row : rows) {
    MeasurementReport& entry = EntryOf(*row);
    const SensorModel& model = ModelOf(*row);
    if (model.Predict(RolesAt(*row, iterate_), entry.h.data()) != Status::kOk) return false;
    model.measurement().geometry.Minus(entry.z.data(), entry.h.data(), innovations.data() + at);
    at += entry.dof;
  }
  return innovations.allFinite();
}

/// h, R, d h / d dx and S of all rows at the iterate, which lies at prior (+) dx.
bool Iekf::Relinearise(std::span<Row* const> rows, const double* dx) {
  for (Row* row : rows) {
    MeasurementReport& entry = EntryOf(*row);
    const SensorModel& model = ModelOf(*row);
    const SensorPlan& plan = PlanOf(*row);
    const double* const* const roles = RolesAt(*row, iterate_);
    if (Evaluate(*row, entry, roles) != Outcome::kAccepted ||
        NoiseOf(*row, roles) != Outcome::kAccepted) {
      return false;
    }
    for (double& r : row->r) r /= row->weight;
    model.measurement().geometry.Minus(entry.z.data(), entry.h.data(), entry.innovation.data());
    std::size_t part = 0;
    for (std::size_t i = 0; i < plan.roles.size(); ++i) {
      if (plan.columns[i] < 0) continue;
      const int offset = plan.parts[part++].offset;
      const Geometry& geometry = model.roles()[i].geometry;
      if (geometry.kind == GeometryKind::kVector) continue;
      const Workspace::Use use(work_);
      Workspace::Vector j = work_.Take(geometry.tangent * geometry.tangent);
      geometry.PlusJacobian(plan.roles[i], dx + offset, j.data());
      Chain(*row, plan.columns[i], geometry.tangent, j.data());
    }
    Project(*row);
  }
  return true;
}

}  // namespace alidade
