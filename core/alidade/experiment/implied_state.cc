// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/implied_state.h"

#include <algorithm>
#include <cmath>

#include "alidade/experiment/truth_match.h"

namespace alidade::internal {
namespace {

/// Returns whether a single measurement of the sensor can initialise a scalar block.
bool IsInvertible(const Problem& problem, const SensorBinding& binding) {
  const int role = binding.model->inverse().role;
  const int roles = static_cast<int>(binding.roles.size());
  if (role < 0 || role >= roles) return false;
  for (int r = 0; r < roles; ++r) {
    if (r != role && binding.roles[static_cast<std::size_t>(r)].block >= 0) return false;
  }
  const BlockId block = binding.roles[static_cast<std::size_t>(role)].block;
  return block >= 0 && problem.layout[block].geometry().ambient == 1;
}

/// Returns whether the measurement and all roles are scalars.
bool IsScalar(const SensorBinding& binding) {
  const auto is_scalar = [](const Space& space) { return space.geometry == Geometry::Vector(1); };
  return is_scalar(binding.model->measurement()) &&
         std::ranges::all_of(binding.model->roles(), is_scalar);
}

/// Solves h(x) = z for the first role by Newton's method, starting from the given value of that
/// role. The other roles do not change. All roles must be scalars. Returns nullopt if the iteration
/// does not converge.
std::optional<double> SolveForFirstRole(const SensorModel& model, std::vector<const double*> roles,
                                        double z) {
  constexpr int kMaxSteps = 20;
  double x = *roles[0];
  roles[0] = &x;
  double slope = 0.0, h = 0.0;
  std::vector<double*> jacobians(roles.size(), nullptr);
  jacobians[0] = &slope;
  const std::vector<int> strides(roles.size(), 1);
  for (int i = 0; i < kMaxSteps; ++i) {
    if (model.Linearise(roles.data(), &h, jacobians.data(), strides.data()) != Status::kOk) break;
    const double step = (z - h) / slope;
    if (!std::isfinite(step)) break;
    x += step;
    if (std::abs(step) <= 1e-12 * std::abs(x)) return x;
  }
  return {};
}

}  // namespace

std::vector<int> TruthsOfRoles(const Problem& problem, const SensorBinding& binding,
                               const std::vector<StreamInfo>& truths) {
  const std::vector<int> match = MatchTruths(problem.layout, truths);
  std::vector<int> indices;
  for (const RoleBinding& role : binding.roles) {
    indices.push_back(role.block < 0 ? -1 : match[static_cast<std::size_t>(role.block)]);
    if (indices.back() < 0) return {};
  }
  return indices;
}

std::vector<const double*> RolesAtTruth(const Truth& truth, const std::vector<int>& truths) {
  std::vector<const double*> roles;
  for (const int index : truths) {
    const auto t = static_cast<std::size_t>(index);
    if (t >= truth.size() || truth[t].empty()) return {};
    roles.push_back(truth[t].data());
  }
  return roles;
}

std::optional<ImpliedState> ImpliedState::Of(const Problem& problem, const SensorBinding& binding,
                                             const std::vector<StreamInfo>& truths) {
  if (binding.model->known_size() > 0) return {};  // x would depend on the known numbers
  if (IsInvertible(problem, binding)) {
    const auto role = static_cast<std::size_t>(binding.model->inverse().role);
    return ImpliedState(binding.model, binding.roles[role].block);
  }
  std::vector<int> role_truths = TruthsOfRoles(problem, binding, truths);
  if (role_truths.empty() || !IsScalar(binding)) return {};
  ImpliedState implied(binding.model, binding.roles[0].block);
  implied.uses_true_roles_ = true;
  implied.truths_ = std::move(role_truths);
  return implied;
}

std::optional<double> ImpliedState::From(const Truth& truth, const double* z) const {
  if (model_->Valid({z}) != Status::kOk) return {};
  if (uses_true_roles_) {
    const std::vector<const double*> roles = RolesAtTruth(truth, truths_);
    if (roles.empty()) return {};
    return SolveForFirstRole(*model_, roles, *z);
  }
  double value = 0.0;
  const std::vector<const double*> roles(model_->roles().size(), nullptr);
  if (model_->Initialise(roles.data(), {z}, nullptr, {.y = &value}) != Status::kOk) return {};
  return value;
}

}  // namespace alidade::internal
