// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/iekf.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "alidade/base/all_finite.h"
#include "alidade/base/error.h"
#include "alidade/base/number_text.h"
#include "alidade/estimation/ekf_equations.h"
#include "alidade/estimation/filter_engine.h"
#include "alidade/estimation/stacked_measurements.h"
#include "alidade/estimation/update_method.h"
#include "alidade/state/tiles.h"

namespace alidade {
namespace internal {
namespace {

/// r' R^-1 r for R = L L', L the lower triangle of `l`; r becomes L^-1 r.
double SquaredNorm(const Workspace::Matrix& l, Workspace::Vector& r) {
  l.triangularView<Eigen::Lower>().solveInPlace(r);
  return r.squaredNorm();
}

/// Gauss-Newton over an update of EkfEquations.
class IekfEquations : public UpdateMethod {
 public:
  IekfEquations(int max_iterations, double tolerance)
      : max_iterations_(max_iterations), tolerance_(tolerance) {}

  std::unique_ptr<UpdateMethod> Clone() const override {
    return std::make_unique<IekfEquations>(*this);
  }
  StepError Step(FilterState& f, double dt_s) override { return ekf_.Step(f, dt_s); }
  void BeginUpdate(FilterState& f, int capacity) override { ekf_.BeginUpdate(f, capacity); }
  Outcome Predict(FilterState& f, PendingMeasurement& pending) override {
    return ekf_.Predict(f, pending);
  }
  double ComputeNis(FilterState& f, PendingMeasurement& pending) override {
    return ekf_.ComputeNis(f, pending);
  }
  Outcome Correct(FilterState& f, std::span<PendingMeasurement* const> rows) override;

 private:
  struct Minimum {
    Workspace::Vector dx;
    int iterations = 0;
    /// That is left, in posterior standard deviations; none where h has no Jacobian.
    std::optional<double> step = std::nullopt;
    bool converged = false;
  };
  /// dx = P v, and a step from there, step = P step_v.
  struct Direction {
    const Workspace::Vector &dx, &v, &step, &step_v;
  };
  std::optional<Minimum> Minimise(FilterState& f, std::span<PendingMeasurement* const> rows);
  double PartThatLowersTheCost(FilterState& f, std::span<PendingMeasurement* const> rows,
                               const Direction& at, const Workspace::Matrix& r,
                               Workspace::Vector& residual);
  bool MoveTo(FilterState& f, const double* dx);
  bool Innovations(FilterState& f, std::span<PendingMeasurement* const> rows,
                   Workspace::Vector& innovations);
  bool Relinearise(FilterState& f, std::span<PendingMeasurement* const> rows, const double* dx);

  EkfEquations ekf_;
  int max_iterations_;
  double tolerance_;
  std::vector<double> iterate_;        ///< values on the way; the state is the prior
  std::vector<double> at_prediction_;  ///< h, innovations and S of its rows
};

Outcome IekfEquations::Correct(FilterState& f, std::span<PendingMeasurement* const> rows) {
  const Workspace::Use use(f.work);
  at_prediction_.clear();
  for (const PendingMeasurement* pending : rows) {
    at_prediction_.insert(at_prediction_.end(), pending->h, pending->s + pending->report->s.size());
  }
  const std::optional<Minimum> minimum = Minimise(f, rows);
  const Outcome outcome = ekf_.CorrectBy(f, rows, minimum ? minimum->dx.data() : nullptr);
  const double* at = at_prediction_.data();
  for (const PendingMeasurement* pending : rows) {
    const auto count = pending->s + pending->report->s.size() - pending->h;
    std::copy_n(at, count, pending->h);
    at += count;
  }
  if (outcome == Outcome::kAccepted && minimum && !minimum->converged) {
    Note(f, "not_converged",
         "an update stopped after " + std::to_string(minimum->iterations) + " iterations" +
             (minimum->step
                  ? ", a step of " + RoundedText(*minimum->step, 3) + " sigma before its optimum"
                  : std::string(" where h has no Jacobian")) +
             "; the last iterate is kept");
  }
  return outcome;
}

/// The optimum of one update, or the last iterate on the way, which the rows are then linearised
/// at, or at the one before where they cannot be. P may be singular: dx = P v all the way, so that
/// dx' P^-1 dx = v' dx. Nothing, and the rows as they were, where there is no first step.
std::optional<IekfEquations::Minimum> IekfEquations::Minimise(
    FilterState& f, std::span<PendingMeasurement* const> rows) {
  const Eigen::Index n = f.size(), m = TotalDof(rows);
  ekf_.AssignColumns(f, rows);
  Minimum minimum{f.work.Take(n)};
  Workspace::Vector& dx = minimum.dx;
  Workspace::Vector v = f.work.Take(n), step = f.work.Take(n), step_v = f.work.Take(n);
  Workspace::Vector y = f.work.Take(m), residual = f.work.Take(m);
  Workspace::Vector linearised = f.work.Take(n);  // where the rows last were
  Workspace::Matrix s = f.work.Take(m, m), r = f.work.Take(m, m);
  dx.setZero();
  v.setZero();
  linearised.setZero();
  for (bool defined = true;; defined = Relinearise(f, rows, dx.data())) {
    const Workspace::Use use(f.work);
    const Stacked at = Stack(f, rows);
    Workspace::Matrix pht = f.work.Take(n, m);
    f.update.CopyColumns(0, pht);
    s = r = at.noise;
    AddProduct(s, at.h, pht);
    if (!defined || !Factorise(s) || !Factorise(r)) {
      if (minimum.iterations == 0) return std::nullopt;
      MoveTo(f, linearised.data());
      Relinearise(f, rows, linearised.data());
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
    const double part = PartThatLowersTheCost(f, rows, {dx, v, step, step_v}, r, residual);
    if (part == 0.0) break;
    dx += part * step;
    v += part * step_v;
  }
  return minimum;
}

/// The largest of 1, 1/2, 1/4, ... of the step with which v' dx + r' R^-1 r does not rise, but for
/// what rounding makes of it; 0 where there is none. `r` is the factor of R, `residual` the
/// innovations at dx, then memory.
double IekfEquations::PartThatLowersTheCost(FilterState& f,
                                            std::span<PendingMeasurement* const> rows,
                                            const Direction& at, const Workspace::Matrix& r,
                                            Workspace::Vector& residual) {
  constexpr double kRounding = 1e-12;
  constexpr int kHalvings = 10;
  const Workspace::Use use(f.work);
  Workspace::Vector there = f.work.Take(at.dx.size());
  const double cost = (at.v.dot(at.dx) + SquaredNorm(r, residual)) * (1.0 + kRounding);
  for (int halvings = 0; halvings <= kHalvings; ++halvings) {
    const double part = std::ldexp(1.0, -halvings);
    there = at.dx + part * at.step;
    if (MoveTo(f, there.data()) && Innovations(f, rows, residual) &&
        (at.v + part * at.step_v).dot(there) + SquaredNorm(r, residual) <= cost) {
      return part;
    }
  }
  return 0.0;
}

/// Puts the iterate at prior (+) dx. False where that is not finite.
bool IekfEquations::MoveTo(FilterState& f, const double* dx) {
  return f.state.Retract(dx, iterate_);
}

/// z (-) h at the iterate, of all rows; false where one is not defined or not finite.
bool IekfEquations::Innovations(FilterState& f, std::span<PendingMeasurement* const> rows,
                                Workspace::Vector& innovations) {
  Eigen::Index at = 0;
  for (PendingMeasurement* pending : rows) {
    const SensorModel& model = *pending->model;
    if (PredictAt(f, *pending, iterate_, pending->h) != Outcome::kAccepted) return false;
    model.measurement().geometry.Minus(pending->z, pending->h, innovations.data() + at);
    at += pending->report->dof;
  }
  return innovations.allFinite();
}

/// h, R, d h / d dx and S of all rows at the iterate, which lies at prior (+) dx.
bool IekfEquations::Relinearise(FilterState& f, std::span<PendingMeasurement* const> rows,
                                const double* dx) {
  for (PendingMeasurement* pending : rows) {
    const SensorModel& model = *pending->model;
    const SensorPlace& place = *pending->place;
    const double* const* const roles = RolesAt(f, *pending, iterate_);
    if (LineariseAt(*pending, roles) != Outcome::kAccepted) return false;
    for (double& r : pending->R) r /= pending->weight;
    ComputeInnovation(*pending);
    const double* const* const at = RolesAt(f, *pending, f.state.values());
    std::size_t part = 0;
    for (std::size_t i = 0; i < place.values.size(); ++i) {
      if (place.columns[i] < 0) continue;
      const int offset = place.parts[part++].offset;
      const Geometry& geometry = model.roles()[i].geometry;
      if (geometry.kind == GeometryKind::kVector) continue;
      const Workspace::Use use(f.work);
      Workspace::Vector j = f.work.Take(geometry.tangent * geometry.tangent);
      PlusJacobian(geometry, at[i], dx + offset, j.data());
      ChainJacobian(*pending, place.columns[i], geometry.tangent, j.data(), f.work);
    }
    ekf_.ComputeNis(f, *pending);
  }
  return true;
}

}  // namespace
}  // namespace internal

Iekf::Iekf(Problem problem, const IekfOptions& options, const std::vector<StreamInfo>& streams)
    : Filter(CheckedProblem(std::move(problem), "Iekf", kCapabilities), options, streams,
             std::make_unique<internal::IekfEquations>(options.max_iterations, options.tolerance)) {
  if (options.jacobian != JacobianPolicy::kLatest) {
    throw Error(ExitCode::kBadConfig,
                "option jacobian is JacobianPolicy::kFirstEstimate; expected kLatest, or an Ekf");
  }
  internal::ExpectOption(options.max_iterations > 1, "max_iterations", options.max_iterations,
                         "at least 2");
  internal::ExpectOption(options.tolerance > 0.0, "tolerance", options.tolerance, "> 0");
}

}  // namespace alidade
