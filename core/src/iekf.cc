// SPDX-License-Identifier: Apache-2.0
#include "alidade/iekf.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "cholesky.h"

namespace alidade {
namespace {

using Llt = Eigen::LLT<Eigen::MatrixXd>;

/// r' R^-1 r
double SquaredNorm(const Llt& r, const Eigen::VectorXd& residual) {
  return r.matrixL().solve(residual).squaredNorm();
}

}  // namespace

Iekf::Iekf(System system, const IekfOptions& options, const std::vector<StreamInfo>& streams)
    : Ekf(std::move(system), options, streams),
      max_iterations_(options.max_iterations),
      tolerance_(options.tolerance) {
  ALIDADE_EXPECTS(options.jacobian == JacobianAt::kLatest && !system_.landmarks);
  ALIDADE_EXPECTS(max_iterations_ > 1 && tolerance_ > 0.0);
  for (const Block& block : system_.layout.blocks()) {
    ALIDADE_EXPECTS(block.status != BlockStatus::kConsidered);
  }
  for (const SensorBinding& sensor : system_.sensors) {
    for (const RoleBinding& role : sensor.roles) {
      ALIDADE_EXPECTS(role.mode != RoleMode::kConsider);
      ALIDADE_EXPECTS(role.linearise_at == LineariseAt::kPrediction);
    }
  }
}

Outcome Iekf::Apply(std::span<Row* const> rows) {
  const std::vector<double> prior = state_.values();
  std::vector<MeasurementReport> first;  // as at the prediction
  for (const Row* row : rows) first.push_back(EntryOf(*row));
  const std::optional<Minimum> minimum = Minimise(rows, prior);
  std::ranges::copy(prior, state_.values().begin());
  if (minimum) correction_ = &minimum->dx;
  const Outcome outcome = Ekf::Apply(rows);
  correction_ = nullptr;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    MeasurementReport& entry = EntryOf(*rows[i]);
    entry.h.swap(first[i].h);
    entry.innovation.swap(first[i].innovation);
    entry.s.swap(first[i].s);
  }
  if (outcome == Outcome::kAccepted && minimum && !minimum->converged) {
    char text[128];
    std::snprintf(text, sizeof(text),
                  "an update stopped after %d iterations, a step of %.3g sigma before its optimum; "
                  "the last iterate is kept",
                  minimum->iterations, minimum->step);
    Note("not_converged", text);
  }
  return outcome;
}

/// The optimum of one update, or the last iterate on the way, which the rows are then linearised
/// at. P may be singular: dx = P v all the way, so that dx' P^-1 dx = v' dx. Nothing, and the rows
/// as they were, where there is no first step.
std::optional<Iekf::Minimum> Iekf::Minimise(std::span<Row* const> rows,
                                            const std::vector<double>& prior) {
  const Eigen::Index n = state_.covariance().size();
  Minimum minimum{Eigen::VectorXd::Zero(n)};
  Eigen::VectorXd& dx = minimum.dx;
  Eigen::VectorXd v = Eigen::VectorXd::Zero(n), innovations;
  for (; minimum.iterations < max_iterations_; ++minimum.iterations) {
    const Stacked at = Stack(rows);
    const Eigen::MatrixXd pht = ProjectionOf(rows);
    Llt s, r;
    if (!internal::Factorise(at.h * pht + at.noise, s) || !internal::Factorise(at.noise, r)) {
      if (minimum.iterations == 0) return std::nullopt;
      break;
    }
    const Eigen::VectorXd y = s.solve(at.innovation + at.h * dx);
    const Eigen::VectorXd step = pht * y - dx, step_v = at.h.transpose() * y - v;
    minimum.step = std::sqrt(step_v.dot(step) + SquaredNorm(r, at.h * step));
    if (minimum.step <= tolerance_) {
      dx += step;
      minimum.converged = true;
      break;
    }
    // Falls, but for what rounding makes of it.
    constexpr double kRounding = 1e-12;
    constexpr int kHalvings = 10;
    const double cost = (v.dot(dx) + SquaredNorm(r, at.innovation)) * (1.0 + kRounding);
    const auto risen = [&](double part) {
      const Eigen::VectorXd there = dx + part * step;
      return !MoveFrom(prior, there) || !Innovations(rows, innovations) ||
             !((v + part * step_v).dot(there) + SquaredNorm(r, innovations) <= cost);
    };
    int halvings = 0;
    while (halvings <= kHalvings && risen(std::ldexp(1.0, -halvings))) ++halvings;
    if (halvings > kHalvings) break;
    const double part = std::ldexp(1.0, -halvings);
    dx += part * step;
    v += part * step_v;
    if (!Relinearise(rows, prior, dx)) break;
  }
  return minimum;
}

/// Puts the state at prior (+) dx; its covariance stays that at the prior. False where that is not
/// finite.
bool Iekf::MoveFrom(const std::vector<double>& prior, const Eigen::VectorXd& dx) {
  std::ranges::copy(prior, state_.values().begin());
  state_.Retract(dx.data(), moved_);
  std::ranges::copy(moved_, state_.values().begin());
  return AllFinite(moved_);
}

/// z (-) h at the state, of all rows; false where one is not defined or not finite.
bool Iekf::Innovations(std::span<Row* const> rows, Eigen::VectorXd& innovations) {
  Eigen::Index at = 0;
  for (const Row* row : rows) at += EntryOf(*row).dof;
  innovations.resize(at);
  at = 0;
  for (Row* row : rows) {
    MeasurementReport& entry = EntryOf(*row);
    const SensorModel& model = BindingOf(*row).model;
    if (model.Predict(PlanOf(*row).roles.data(), entry.h.data()) != Status::kOk) return false;
    model.measurement().geometry.Minus(entry.z.data(), entry.h.data(), innovations.data() + at);
    at += entry.dof;
  }
  return innovations.allFinite();
}

/// h, R, d h / d dx and S of all rows at the state, which lies at prior (+) dx.
bool Iekf::Relinearise(std::span<Row* const> rows, const std::vector<double>& prior,
                       const Eigen::VectorXd& dx) {
  for (Row* row : rows) {
    MeasurementReport& entry = EntryOf(*row);
    const SensorBinding& binding = BindingOf(*row);
    const SensorPlan& plan = PlanOf(*row);
    if (Evaluate(*row, entry) != Outcome::kAccepted ||
        NoiseOf(*row, plan.roles.data()) != Outcome::kAccepted) {
      return false;
    }
    for (double& r : row->r) r /= row->weight;
    binding.model.measurement().geometry.Minus(entry.z.data(), entry.h.data(),
                                               entry.innovation.data());
    for (std::size_t i = 0; i < binding.roles.size(); ++i) {
      if (plan.columns[i] < 0) continue;
      const Block& block = state_.layout()[binding.roles[i].block];
      const Geometry& geometry = block.geometry();
      RowMajor j(geometry.tangent, geometry.tangent);
      geometry.PlusJacobian(prior.data() + block.value_offset, dx.data() + block.tangent_offset,
                            j.data());
      Chain(*row, plan.columns[i], j);
    }
    Project(*row);
  }
  return true;
}

}  // namespace alidade
