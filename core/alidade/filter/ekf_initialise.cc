// SPDX-License-Identifier: Apache-2.0
//
// The inverse measurement model: how blocks that have no value yet start from a measurement.
#include <algorithm>
#include <cmath>

#include "alidade/filter/ekf.h"

namespace alidade {

/// y = g(other roles, z, prior) of the roles that the sensor initialises, one after the other, and
/// what it is correlated with. `prior` may be null where the model needs none. kAccepted, or why
/// not.
Outcome Ekf::Invert(Row& row, const LandmarkOptions::Prior* prior, Inverse& inverse) {
  const SensorBinding& binding = BindingOf(row);
  const SensorModel& model = binding.model;
  const auto first = static_cast<std::size_t>(model.initialised_role());
  const auto count = static_cast<std::size_t>(model.initialised_count());
  const std::span<const Space> targets = std::span(model.roles()).subspan(first, count);
  int rows = 0, size = 0;
  for (const Space& target : targets) {
    rows += target.geometry.tangent;
    size += target.geometry.ambient;
  }
  std::vector<const double*> roles(binding.roles.size(), nullptr);
  std::vector<RowMajor> jacobians(roles.size());
  std::vector<double*> jx(roles.size(), nullptr);
  for (std::size_t i = 0; i < roles.size(); ++i) {
    const RoleBinding& role = binding.roles[i];
    if ((i >= first && i < first + count) || role.block < 0) continue;
    roles[i] = state_.value(role.block);
    const Block& block = state_.layout()[role.block];
    if (role.mode == RoleMode::kKnown || !block.has_covariance()) continue;
    jacobians[i] = RowMajor::Constant(rows, block.geometry().tangent, std::nan(""));
    jx[i] = jacobians[i].data();
  }
  const int m = model.measurement().geometry.tangent;
  RowMajor jz = RowMajor::Constant(rows, m, std::nan(""));
  RowMajor jp = RowMajor::Constant(rows, model.prior_size(), std::nan(""));
  inverse.y.resize(static_cast<std::size_t>(size));
  const Status status = model.Initialise(roles.data(), row.measurement->values.data(),
                                         prior == nullptr ? nullptr : &prior->inverse_distance,
                                         inverse.y.data(), jx.data(), jz.data(), jp.data());
  Outcome outcome = OutcomeOf(status);
  if (status == Status::kOk) {
    double* y = inverse.y.data();
    for (std::size_t i = 0; i < count; ++i) {
      targets[i].geometry.Normalise(y);
      roles[first + i] = y;
      y += targets[i].geometry.ambient;
    }
    outcome = NoiseOf(row, roles.data());
  }
  if (outcome == Outcome::kFailed) NotePluginFailure(binding);
  if (outcome != Outcome::kAccepted) {
    return outcome == Outcome::kFailed ? outcome : Outcome::kInvalid;
  }
  const Eigen::Map<const RowMajor> r(row.r.data(), m, m);
  inverse.own = jz * r * jz.transpose();
  if (prior != nullptr) inverse.own += prior->sigma * prior->sigma * jp * jp.transpose();
  bool finite = AllFinite(inverse.y) && inverse.own.allFinite();
  for (std::size_t i = 0; i < roles.size(); ++i) {
    if (jx[i] == nullptr) continue;
    finite = finite && jacobians[i].allFinite();
    inverse.from.push_back(binding.roles[i].block);
    inverse.jacobians.emplace_back(jacobians[i]);
  }
  return finite ? Outcome::kAccepted : Outcome::kNotFinite;
}

/// Initialises the blocks that wait for one of these measurements, each consuming its measurement;
/// what then still needs a block without a value is not ready.
void Ekf::InitialiseFromMeasurements() {
  const auto missing = [this](const RoleBinding& role) {
    return role.block >= 0 && !state_.layout()[role.block].present;
  };
  for (bool progress = true; progress;) {
    progress = false;
    for (Row& row : rows()) {
      Outcome& outcome = EntryOf(row).outcome;
      const SensorBinding& binding = BindingOf(row);
      const int role = binding.model.initialised_role();
      if (outcome != Outcome::kAccepted || role < 0) continue;
      const RoleBinding& target = binding.roles[static_cast<std::size_t>(role)];
      const auto waits = [&](const Prior& prior) {
        return prior.block == target.block && prior.from == binding.name;
      };
      if (std::count_if(binding.roles.begin(), binding.roles.end(), missing) != 1 ||
          !missing(target) || std::none_of(system_.priors.begin(), system_.priors.end(), waits)) {
        continue;
      }
      outcome = InitialiseBlock(row);
      progress = progress || outcome == Outcome::kInitialised;
    }
  }
  for (Row& row : rows()) {
    Outcome& outcome = EntryOf(row).outcome;
    if (outcome == Outcome::kAccepted && !PlanOf(row).ready) outcome = Outcome::kNotReady;
  }
}

/// Gives the block of the sensor's initialised role the value that the measurement implies, with
/// its covariance and correlations, in place of any that it has. kInitialised, or why not.
Outcome Ekf::InitialiseBlock(Row& row) {
  const SensorBinding& binding = BindingOf(row);
  const BlockId id =
      binding.roles[static_cast<std::size_t>(binding.model.initialised_role())].block;
  Inverse inverse;
  const Outcome outcome = Invert(row, nullptr, inverse);
  if (outcome != Outcome::kAccepted) return outcome;
  state_.Initialise(id, inverse.y.data(), inverse.from, inverse.jacobians, inverse.own);
  if (!first_.empty()) FirstEstimate(id).clear();
  Bind();
  return Outcome::kInitialised;
}

}  // namespace alidade
