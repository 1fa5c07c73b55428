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

/// Returns r' R^-1 r for R = L L'. L is the lower triangle of `l`. Sets r to L^-1 r.
double SquaredNorm(const Workspace::Matrix& l, Workspace::Vector& r) {
  l.triangularView<Eigen::Lower>().solveInPlace(r);
  return r.squaredNorm();
}

/// Equations of Iekf: Gauss-Newton iterations, each with an update of EkfEquations.
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
  /// Result of the iterations.
  struct Minimum {
    Workspace::Vector dx;
    int iterations = 0;
    /// Length of the next step in posterior standard deviations. nullopt: h has no Jacobian.
    std::optional<double> step = std::nullopt;
    bool converged = false;
  };
  /// An iterate, dx = P v, and the step from this iterate to the next one, step = P step_v.
  struct IterateStep {
    const Workspace::Vector &dx, &v, &step, &step_v;
  };
  std::optional<Minimum> Minimise(FilterState& f, std::span<PendingMeasurement* const> rows);
  double FindStepFraction(FilterState& f, std::span<PendingMeasurement* const> rows,
                          const IterateStep& full, const Workspace::Matrix& r,
                          Workspace::Vector& residual);
  bool SetIterate(FilterState& f, const double* dx);
  bool ComputeInnovations(FilterState& f, std::span<PendingMeasurement* const> rows,
                          Workspace::Vector& innovations);
  bool Relinearise(FilterState& f, std::span<PendingMeasurement* const> rows, const double* dx);

  EkfEquations ekf_;
  int max_iterations_;
  double tolerance_;
  std::vector<double> iterate_;             ///< x at the iterate (f.state is the prediction)
  std::vector<double> prediction_numbers_;  ///< h, innovations and S at the prediction
};

Outcome IekfEquations::Correct(FilterState& f, std::span<PendingMeasurement* const> rows) {
  const Workspace::Use use(f.work);
  prediction_numbers_.clear();
  for (const PendingMeasurement* pending : rows) {
    prediction_numbers_.insert(prediction_numbers_.end(), pending->h,
                               pending->s + pending->report->s.size());
  }
  const std::optional<Minimum> minimum = Minimise(f, rows);
  const Outcome outcome = ekf_.CorrectBy(f, rows, minimum ? minimum->dx.data() : nullptr);
  const double* source = prediction_numbers_.data();
  for (const PendingMeasurement* pending : rows) {
    const auto count = pending->s + pending->report->s.size() - pending->h;
    std::copy_n(source, count, pending->h);
    source += count;
  }
  if (outcome == Outcome::kAccepted && minimum && !minimum->converged) {
    AddEvent(
        f, EventKind::kNotConverged,
        "an update stopped after " + std::to_string(minimum->iterations) + " iterations" +
            (minimum->step ? ": the next step would be " + RoundedText(*minimum->step, 3) + " sigma"
                           : std::string(" because h has no Jacobian")) +
            "; the last iterate is used");
  }
  return outcome;
}

/// Computes the minimum of the cost of one update. If the iteration does not converge, returns the
/// last iterate. On return, the measurements are linearised at the last iterate at which all of
/// them can be linearised. P may be singular, because dx = P v for all iterates, so dx' P^-1 dx =
/// v' dx. If the first step is not possible, returns nullopt and leaves the measurements unchanged.
std::optional<IekfEquations::Minimum> IekfEquations::Minimise(
    FilterState& f, std::span<PendingMeasurement* const> rows) {
  const Eigen::Index n = f.size(), m = TotalDof(rows);
  ekf_.AssignColumns(f, rows);
  Minimum minimum{f.work.Take(n)};
  Workspace::Vector& dx = minimum.dx;
  Workspace::Vector v = f.work.Take(n), step = f.work.Take(n), step_v = f.work.Take(n);
  Workspace::Vector y = f.work.Take(m), residual = f.work.Take(m);
  Workspace::Vector linearised = f.work.Take(n);  // dx at the last linearisation
  Workspace::Matrix s = f.work.Take(m, m), r = f.work.Take(m, m);
  dx.setZero();
  v.setZero();
  linearised.setZero();
  for (bool is_defined = true;; is_defined = Relinearise(f, rows, dx.data())) {
    const Workspace::Use use(f.work);
    const StackedMeasurements stacked = Stack(f, rows);
    Workspace::Matrix pht = f.work.Take(n, m);
    f.update.CopyColumns(0, pht);
    s = r = stacked.noise;
    AddProduct(s, stacked.h, pht);
    if (!is_defined || !Factorise(s) || !Factorise(r)) {
      if (minimum.iterations == 0) return std::nullopt;
      SetIterate(f, linearised.data());
      Relinearise(f, rows, linearised.data());
      minimum.step.reset();
      break;
    }
    linearised = dx;
    ++minimum.iterations;
    y = stacked.innovation;
    y.noalias() += stacked.h * dx;
    s.triangularView<Eigen::Lower>().solveInPlace(y);
    s.triangularView<Eigen::Lower>().transpose().solveInPlace(y);
    step = -dx;
    step.noalias() += pht * y;
    step_v = -v;
    step_v.noalias() += stacked.h.transpose() * y;
    residual.noalias() = stacked.h * step;
    minimum.step = std::sqrt(step_v.dot(step) + SquaredNorm(r, residual));
    if (*minimum.step <= tolerance_) {
      dx += step;
      minimum.converged = true;
      break;
    }
    if (minimum.iterations == max_iterations_) break;
    residual = stacked.innovation;
    const double fraction = FindStepFraction(f, rows, {dx, v, step, step_v}, r, residual);
    if (fraction == 0.0) break;
    dx += fraction * step;
    v += fraction * step_v;
  }
  return minimum;
}

/// Returns the largest fraction 1, 1/2, 1/4, ... of the step that does not increase v' dx + r' R^-1
/// r by more than rounding errors. Returns 0 if every fraction fails. `r` is the factor of R.
/// `residual` contains the innovations at dx and is overwritten.
double IekfEquations::FindStepFraction(FilterState& f, std::span<PendingMeasurement* const> rows,
                                       const IterateStep& full, const Workspace::Matrix& r,
                                       Workspace::Vector& residual) {
  constexpr double kRounding = 1e-12;
  constexpr int kHalvings = 10;
  const Workspace::Use use(f.work);
  Workspace::Vector dx = f.work.Take(full.dx.size());
  const double cost = (full.v.dot(full.dx) + SquaredNorm(r, residual)) * (1.0 + kRounding);
  for (int halvings = 0; halvings <= kHalvings; ++halvings) {
    const double fraction = std::ldexp(1.0, -halvings);
    dx = full.dx + fraction * full.step;
    if (SetIterate(f, dx.data()) && ComputeInnovations(f, rows, residual) &&
        (full.v + fraction * full.step_v).dot(dx) + SquaredNorm(r, residual) <= cost) {
      return fraction;
    }
  }
  return 0.0;
}

/// Sets the iterate to prediction (+) dx. Returns false if the iterate is not finite.
bool IekfEquations::SetIterate(FilterState& f, const double* dx) {
  return f.state.Retract(dx, iterate_);
}

/// Computes z (-) h of all measurements at the iterate. Returns false if h of a measurement is not
/// defined or an innovation is not finite.
bool IekfEquations::ComputeInnovations(FilterState& f, std::span<PendingMeasurement* const> rows,
                                       Workspace::Vector& innovations) {
  Eigen::Index offset = 0;
  for (PendingMeasurement* pending : rows) {
    const SensorModel& model = *pending->model;
    if (PredictAt(f, *pending, iterate_, pending->h) != Outcome::kAccepted) return false;
    model.measurement().geometry.Minus(pending->z, pending->h, innovations.data() + offset);
    offset += pending->report->dof;
  }
  return innovations.allFinite();
}

/// Computes h, R, d h / d dx and S of all measurements at the iterate, prediction (+) dx. Returns
/// false if a model fails.
bool IekfEquations::Relinearise(FilterState& f, std::span<PendingMeasurement* const> rows,
                                const double* dx) {
  for (PendingMeasurement* pending : rows) {
    const SensorModel& model = *pending->model;
    const SensorPlace& place = *pending->place;
    const double* const* const roles = RolesAt(f, *pending, iterate_);
    if (LineariseAt(*pending, roles) != Outcome::kAccepted) return false;
    for (double& r : pending->R) r /= pending->weight;
    ComputeInnovation(*pending);
    const double* const* const prediction = RolesAt(f, *pending, f.state.values());
    std::size_t part = 0;
    for (std::size_t i = 0; i < place.values.size(); ++i) {
      if (place.columns[i] < 0) continue;
      const int offset = place.parts[part++].offset;
      const Geometry& geometry = model.roles()[i].geometry;
      if (geometry.is_vector()) continue;
      const Workspace::Use use(f.work);
      Workspace::Vector j = f.work.Take(geometry.tangent * geometry.tangent);
      PlusJacobian(geometry, prediction[i], dx + offset, j.data());
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
                "option jacobian is JacobianPolicy::kFirstEstimate; expected kLatest; or use an "
                "Ekf");
  }
  internal::ExpectOption(options.max_iterations > 1, "max_iterations", options.max_iterations,
                         "at least 2");
  internal::ExpectOption(options.tolerance > 0.0, "tolerance", options.tolerance, "a number > 0");
}

}  // namespace alidade
