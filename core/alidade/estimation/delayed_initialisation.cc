// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/delayed_initialisation.h"

#include <algorithm>

#include "alidade/base/all_finite.h"

namespace alidade::internal {
namespace {

bool IsMissing(const FilterState& f, const RoleBinding& role) {
  return role.block >= 0 && !f.state.layout()[role.block].present;
}

/// Returns whether a measurement initialises a block. The block must be the only block of the
/// sensor without a value, and the prior of the block must name the sensor.
bool IsAwaited(const FilterState& f, const PendingMeasurement& pending) {
  const SensorBinding& sensor = *pending.binding;
  const int index = sensor.model->inverse().role;
  if (pending.report->outcome != Outcome::kAccepted || index < 0) return false;
  const RoleBinding& target = sensor.roles[static_cast<std::size_t>(index)];
  const auto missing = [&](const RoleBinding& role) { return IsMissing(f, role); };
  const auto waits = [&](const Prior& prior) {
    return prior.block == target.block && prior.sensor == sensor.name;
  };
  return missing(target) && std::ranges::count_if(sensor.roles, missing) == 1 &&
         std::ranges::any_of(f.problem_index->problem.priors, waits);
}

}  // namespace

Outcome InvertAt(const SensorBinding& sensor, const SensorPlace& place,
                 const Measurement& measurement, const double* prior, Roles& roles,
                 InverseMeasurement& inverse) {
  const SensorModel& model = *sensor.model;
  const auto first = static_cast<std::size_t>(model.inverse().role);
  const auto count = static_cast<std::size_t>(model.inverse().count);
  const std::span<const Space> targets = std::span(model.roles()).subspan(first, count);
  int rows = 0, size = 0, columns = 0, max_columns = 0;
  for (const Space& target : targets) {
    rows += target.geometry.tangent;
    size += target.geometry.ambient;
  }
  for (const Space& role : model.roles()) max_columns += role.geometry.tangent;
  std::fill_n(roles.begin() + model.inverse().role, count, nullptr);
  inverse.from.clear();
  inverse.role_jacobians.resize(static_cast<std::size_t>(rows) *
                                static_cast<std::size_t>(max_columns));
  inverse.role_jacobian_starts.assign(place.values.size(), nullptr);
  for (std::size_t i = 0; i < place.values.size(); ++i) {
    if (roles[i] == nullptr || place.columns[i] < 0) continue;
    inverse.from.push_back(sensor.roles[i].block);
    inverse.role_jacobian_starts[i] = inverse.role_jacobians.data() + rows * columns;
    columns += model.roles()[i].geometry.tangent;
  }
  inverse.y.resize(static_cast<std::size_t>(size));
  inverse.by_z.resize(rows, model.measurement().geometry.tangent);
  inverse.by_prior.resize(rows, model.inverse().prior_size);
  const Status status =
      model.Initialise(roles.data(), {measurement.values.data(), measurement.known.data()}, prior,
                       {.y = inverse.y.data(),
                        .jx = inverse.role_jacobian_starts.data(),
                        .jz = inverse.by_z.data(),
                        .jp = inverse.by_prior.data()});
  if (status != Status::kOk) return OutcomeOf(status);
  inverse.by_x.resize(rows, columns);
  Eigen::Index column = 0;
  for (std::size_t i = 0; i < place.values.size(); ++i) {
    if (inverse.role_jacobian_starts[i] == nullptr) continue;
    const int width = model.roles()[i].geometry.tangent;
    inverse.by_x.middleCols(column, width) =
        Eigen::Map<const RowMajor>(inverse.role_jacobian_starts[i], rows, width);
    column += width;
  }
  double* y = inverse.y.data();
  for (std::size_t i = 0; i < count; ++i) {
    targets[i].geometry.Normalise(y);
    roles[first + i] = y;
    y += targets[i].geometry.ambient;
  }
  const bool finite = AllFinite(inverse.y) && inverse.by_x.allFinite() &&
                      inverse.by_z.allFinite() && inverse.by_prior.allFinite();
  return finite ? Outcome::kAccepted : Outcome::kNotFinite;
}

bool IsReady(const FilterState& f, const PendingMeasurement& pending) {
  return std::ranges::none_of(pending.binding->roles,
                              [&](const RoleBinding& role) { return IsMissing(f, role); });
}

Outcome Invert(FilterState& f, PendingMeasurement& pending, const LandmarkOptions::Prior* prior,
               InverseMeasurement& inverse) {
  RolesAt(f, pending, f.state.values());
  Roles roles = pending.roles;  // a copy, because InvertAt adds pointers to y
  Outcome outcome = InvertAt(*pending.binding, *pending.place, *pending.measurement,
                             prior == nullptr ? nullptr : &prior->inverse_distance, roles, inverse);
  if (outcome == Outcome::kAccepted) outcome = NoiseAt(pending, roles.data());
  if (outcome == Outcome::kFailed) ReportPluginFailure(f, pending);
  if (outcome != Outcome::kAccepted) {
    return outcome == Outcome::kOutOfDomain ? Outcome::kInvalid : outcome;
  }
  const int m = pending.report->dof;
  const Eigen::Map<const RowMajor> r(pending.R.data(), m, m);
  const RowMajor& jp = inverse.by_prior;
  inverse.by_z_r.noalias() = inverse.by_z * r;
  inverse.noise_covariance.noalias() = inverse.by_z_r * inverse.by_z.transpose();
  if (prior != nullptr) {
    inverse.noise_covariance.noalias() += prior->sigma * prior->sigma * jp * jp.transpose();
  }
  return inverse.noise_covariance.allFinite() ? Outcome::kAccepted : Outcome::kNotFinite;
}

[[gnu::noinline]] void InitialiseWaiting(FilterState& f, std::span<PendingMeasurement> rows) {
  InverseMeasurement inverse;
  for (bool progress = true; progress;) {
    progress = false;
    for (PendingMeasurement& pending : rows) {
      if (!IsAwaited(f, pending)) continue;
      pending.report->outcome = Invert(f, pending, nullptr, inverse);
      if (pending.report->outcome != Outcome::kAccepted) continue;
      Initialise(f, pending, inverse);
      pending.report->outcome = Outcome::kInitialised;
      progress = true;
    }
  }
  for (const PendingMeasurement& pending : rows) {
    Outcome& outcome = pending.report->outcome;
    if (outcome == Outcome::kAccepted && !IsReady(f, pending)) outcome = Outcome::kNotReady;
  }
}

void Initialise(FilterState& f, const PendingMeasurement& pending,
                const InverseMeasurement& inverse) {
  const SensorBinding& sensor = *pending.binding;
  const BlockId id = sensor.roles[static_cast<std::size_t>(sensor.model->inverse().role)].block;
  f.state.Initialise({&id, 1}, inverse.y.data(), inverse.from, inverse.by_x,
                     inverse.noise_covariance);
  f.first_estimates[static_cast<std::size_t>(id)].clear();
  f.Activate();
  f.motions.EndInterval();
}

}  // namespace alidade::internal
