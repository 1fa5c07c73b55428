// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/problem.h"

#include <algorithm>
#include <cmath>

#include "alidade/base/all_finite.h"
#include "alidade/base/error.h"
#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/estimation/owned_state.h"
#include "alidade/state/dense_algebra.h"

namespace alidade {
namespace {

using internal::NamesOf;

[[noreturn]] void Fail(const std::string& place, const std::string& defect) {
  throw Error(ExitCode::kBadConfig, place + ": " + defect);
}

/// Checks an initial value and returns it as a prior.
Prior PriorOf(const InitialValue& initial, const Space& space, BlockId block,
              const std::string& place) {
  Prior prior{block, initial.mean, {}, initial.sensor};
  if (!initial.sensor.empty()) return prior;
  const Geometry& geometry = space.geometry;
  const std::string value =
      "the initial value of '" + space.name + "', " + internal::WithArticle(ToString(geometry));
  if (std::ssize(prior.mean) != geometry.ambient) {
    Fail(place, value + ", has the size " + std::to_string(prior.mean.size()) + "; expected " +
                    std::to_string(geometry.ambient));
  }
  if (!internal::AllFinite(prior.mean)) {
    Fail(place, value + ", is not finite; expected finite numbers");
  }
  if (DistanceFrom(geometry, prior.mean.data()) > kUnitTolerance) {
    Fail(place, value + ", does not have unit length; expected a length of 1");
  }
  geometry.Normalise(prior.mean.data());
  if (initial.status == BlockStatus::kConstant) return prior;
  const int n = geometry.tangent;
  if (initial.covariance.size() > 0) {
    constexpr double kRounding = 1e-11;  // relative to the largest variance
    prior.covariance = initial.covariance;
    const bool fits = prior.covariance.rows() == n && prior.covariance.cols() == n &&
                      prior.covariance.allFinite() &&
                      prior.covariance.isApprox(prior.covariance.transpose());
    Eigen::LDLT<Eigen::MatrixXd> ldlt;
    Eigen::MatrixXd root;
    if (!fits || internal::SquareRootOf(prior.covariance, ldlt, root) < -kRounding) {
      Fail(place, value +
                      ", has an invalid covariance; expected a symmetric, positive "
                      "semi-definite matrix of " +
                      std::to_string(n) + " x " + std::to_string(n) + " finite numbers");
    }
    return prior;
  }
  std::vector<double> sigma = initial.sigma;
  if (sigma.size() == 1) sigma.assign(static_cast<std::size_t>(n), sigma[0]);
  const auto is_valid = [](double element) { return std::isfinite(element) && element >= 0.0; };
  if (std::ssize(sigma) != n || !std::ranges::all_of(sigma, is_valid)) {
    Fail(place, value + ", has an invalid standard deviation; expected a finite number >= 0" +
                    (n == 1 ? "" : ", or " + std::to_string(n) + " such numbers"));
  }
  prior.covariance = Eigen::Map<const Eigen::VectorXd>(sigma.data(), n).cwiseAbs2().asDiagonal();
  return prior;
}

/// Returns the index of the stream. If the name is new, appends the stream.
int AddStream(Problem& problem, const StreamInfo& stream, const std::string& place) {
  const auto found = std::ranges::find(problem.streams, stream.name, &StreamInfo::name);
  if (found == problem.streams.end()) {
    problem.streams.push_back(stream);
    return static_cast<int>(problem.streams.size()) - 1;
  }
  if (found->size != stream.size || found->known != stream.known) {
    const auto sizes = [](const StreamInfo& info) {
      return "size " + std::to_string(info.size) + " and " + std::to_string(info.known) +
             " known numbers";
    };
    Fail(place, "stream '" + stream.name + "' is already used with measurements of " +
                    sizes(*found) + "; expected " + sizes(stream));
  }
  return static_cast<int>(found - problem.streams.begin());
}

/// Throws an Error if the block of the binding cannot fill the role.
void CheckRole(const Problem& problem, const Space& role, const RoleBinding& binding,
               const std::string& place) {
  const std::string geometry = internal::WithArticle(ToString(role.geometry));
  if (binding.block < 0) {
    if (!role.optional()) {
      Fail(place, "role '" + role.name + "' has no block; expected a block that is " + geometry);
    }
    return;
  }
  if (binding.block >= std::ssize(problem.layout.blocks())) {
    Fail(place, "role '" + role.name +
                    "' has a block of another problem; expected a block of this problem that is " +
                    geometry);
  }
  const Block& block = problem.layout[binding.block];
  if (block.geometry() == role.geometry) return;
  Fail(place, "role '" + role.name + "' has the block '" + block.name + "', which is " +
                  internal::WithArticle(ToString(block.geometry())) +
                  "; expected a block that is " + geometry);
}

}  // namespace

InitialValue::InitialValue(std::string block_name, std::vector<double> value,
                           std::vector<double> deviations, BlockStatus block_status)
    : block(std::move(block_name)),
      mean(std::move(value)),
      sigma(std::move(deviations)),
      status(block_status) {}

InitialValue::InitialValue(std::string block_name, std::vector<double> value, double deviation,
                           BlockStatus block_status)
    : InitialValue(std::move(block_name), std::move(value), std::vector{deviation}, block_status) {}

InitialValue::InitialValue(std::string block_name, double value, double deviation,
                           BlockStatus block_status)
    : InitialValue(std::move(block_name), std::vector{value}, std::vector{deviation},
                   block_status) {}

InitialValue InitialValue::WithCovariance(std::string block, std::vector<double> mean,
                                          Eigen::MatrixXd covariance, BlockStatus status) {
  InitialValue initial(std::move(block), std::move(mean), std::vector<double>(), status);
  initial.covariance = std::move(covariance);
  return initial;
}

InitialValue InitialValue::Constant(std::string block, std::vector<double> value) {
  return {std::move(block), std::move(value), std::vector<double>(), BlockStatus::kConstant};
}

InitialValue InitialValue::FromMeasurement(std::string block, std::string sensor) {
  InitialValue initial(std::move(block), std::vector<double>(), std::vector<double>());
  initial.sensor = std::move(sensor);
  return initial;
}

OwnedState OwnedState::Of(const OwnedRole& owned) {
  if (owned.sqrt_prior.empty()) return {InitialValue::Constant({}, owned.mean), owned};
  const auto n = static_cast<Eigen::Index>(std::sqrt(owned.sqrt_prior.size()));
  const Eigen::Map<const RowMajor> root(owned.sqrt_prior.data(), n, n);
  return {InitialValue::WithCovariance({}, owned.mean, root * root.transpose()), owned};
}

BlockId StateHandle::operator[](std::string_view block) const {
  const auto found = blocks.find(block);
  if (found != blocks.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& entry : blocks) names.push_back(entry.first);
  Fail("state '" + name + "'", "the state has no block '" + std::string(block) +
                                   "'; expected one of " + internal::Join(names));
}

StateHandle Problem::AddState(const std::string& name, SharedMotion model,
                              const std::vector<InitialValue>& initial, const InputBinding& input) {
  const std::string place = "state '" + name + "'";
  const auto has_name = [&](const Block& block) { return block.owner == name; };
  if (std::ranges::any_of(layout.blocks(), has_name)) {
    Fail(place, "the name is already used; expected another name");
  }
  const std::vector<Space>& spaces = model->blocks();
  for (const InitialValue& value : initial) {
    if (std::ranges::count(initial, value.block, &InitialValue::block) > 1) {
      Fail(place, "block '" + value.block + "' has several initial values; expected one");
    }
    if (std::ranges::count(spaces, value.block, &Space::name) == 0) {
      Fail(place, "the model has no block '" + value.block + "'; expected one of " +
                      internal::Join(NamesOf(spaces)));
    }
  }
  std::vector<InitialValue> values;  // in the order of the model's blocks
  std::vector<Prior> added;
  for (const Space& space : spaces) {
    const auto found = std::ranges::find(initial, space.name, &InitialValue::block);
    if (found != initial.end()) {
      values.push_back(*found);
    } else if ((space.flags & ALIDADE_ROLE_OWNED) != 0) {
      values.push_back(InitialValue::Constant(space.name, space.geometry.Identity()));
    } else {
      Fail(place, "block '" + space.name + "' has no initial value; expected one");
    }
    if (values.back().name.empty()) values.back().name = space.name;
    added.push_back(PriorOf(values.back(), space, -1, place));
  }
  if (!input.stream.empty() && !model->has_input()) {
    Fail(place, "model '" + model->name() + "' has no control input; remove `input`");
  }
  Problem changed = *this;  // a copy, so that an exception leaves this problem unchanged
  StateHandle handle{name, {}, -1};
  MotionBinding motion{name, std::move(model), {}, {}};
  for (std::size_t i = 0; i < spaces.size(); ++i) {
    const std::string& block = values[i].name;
    const std::string full = name + '.' + block;
    if (changed.layout.Find(full) >= 0) {
      Fail(place, "block '" + full + "' already exists; expected another name");
    }
    const BlockId id = changed.layout.Declare(full, name, spaces[i], values[i].status);
    handle.blocks.emplace(block, id);
    motion.blocks.push_back(id);
    added[i].block = id;
  }
  std::ranges::move(added, std::back_inserter(changed.priors));
  if (motion.model->has_input()) {
    const Space& space = motion.model->input();
    motion.input = input;
    if (input.stream.empty()) motion.input.stream = name + '.' + space.name;
    handle.input = AddStream(changed, {motion.input.stream, space.geometry.ambient}, place);
  }
  changed.motions.push_back(std::move(motion));
  *this = std::move(changed);
  return handle;
}

SensorHandle Problem::AddSensor(const std::string& name, SharedSensor model,
                                std::vector<RoleBinding> roles, const SensorOptions& options) {
  const std::string place = "sensor '" + name + "'";
  if (FindSensor(name) >= 0) Fail(place, "the name is already used; expected another name");
  const std::vector<Space>& spaces = model->roles();
  const auto landmark_roles = std::ranges::count_if(spaces, &Space::landmark);
  const auto block_roles = std::ssize(spaces) - landmark_roles;
  if (std::ssize(roles) > block_roles) {
    Fail(place, "the number of blocks for the roles is " + std::to_string(roles.size()) +
                    "; expected at most " + std::to_string(block_roles) + ": " +
                    internal::Join(NamesOf(spaces)));
  }
  roles.resize(spaces.size());
  const auto is_owned = [&](std::size_t i) {
    return (spaces[i].flags & ALIDADE_ROLE_OWNED) != 0 && roles[i].block < 0;
  };
  for (std::size_t i = 0; i < spaces.size(); ++i) {
    if (!spaces[i].landmark() && !is_owned(i)) CheckRole(*this, spaces[i], roles[i], place);
    const BlockId block = roles[i].block;
    if (block < 0 || std::ranges::count(roles, block, &RoleBinding::block) < 2) continue;
    Fail(place, "block '" + layout[block].name +
                    "' fills two roles; expected a different block for each role");
  }
  for (const auto& entry : options.owned) {
    const std::size_t role = entry.first;
    if (role < spaces.size() && is_owned(role)) continue;
    Fail(place, "role " + std::to_string(role) +
                    " in the option `owned` is not a model parameter state; expected a role with "
                    "the flag ALIDADE_ROLE_OWNED and without a block");
  }
  if (options.loss.kind != LossKind::kNone && !(options.loss.scale > 0.0)) {
    Fail(place, "the scale of the robust loss is " + internal::RoundedText(options.loss.scale) +
                    "; expected a number > 0");
  }
  Problem changed = *this;  // a copy, so that an exception leaves this problem unchanged
  for (std::size_t i = 0; i < spaces.size(); ++i) {
    if (!is_owned(i)) continue;
    const auto option = options.owned.find(i);
    roles[i] = internal::AddOwnedState(
        changed, name, spaces[i],
        option != options.owned.end() ? option->second : OwnedState::Of(model->owned(i)));
  }
  if (landmark_roles > 0 && !changed.landmarks) changed.landmarks.emplace();
  const std::string& stream = options.stream.empty() ? name : options.stream;
  const SensorHandle handle{
      static_cast<int>(sensors.size()),
      AddStream(changed, {stream, model->measurement().geometry.ambient, 0.0, model->known_size()},
                place)};
  changed.sensors.push_back({name, stream, std::move(model), std::move(roles), options.loss,
                             options.xyz, options.outlier_rejection});
  *this = std::move(changed);
  return handle;
}

BlockId internal::AddOwnedState(Problem& problem, const std::string& sensor, const Space& role,
                                OwnedState state) {
  const std::string place = "sensor '" + sensor + "'";
  if (!state.initial.sensor.empty()) {
    Fail(place, "model parameter state '" + role.name +
                    "' cannot start from a measurement; expected mean and sigma");
  }
  const std::string name = sensor + '.' + role.name;
  if (problem.layout.Find(name) >= 0) {
    Fail(place, "model parameter state '" + name + "' already exists; expected another name");
  }
  Prior prior = PriorOf(state.initial, role, -1, place);
  const BlockStatus status = state.initial.status;
  if (status == BlockStatus::kConstant) state.process.dynamics = OwnedDynamics::kConstant;
  state.process.mean = prior.mean;
  state.process.sqrt_prior.clear();
  OwnedRole checked = state.process;
  const std::string defect = CheckOwned(role.geometry, checked);
  if (!defect.empty()) {
    Fail(place, "the dynamics of the model parameter state '" + role.name + "' " + defect);
  }
  prior.block = problem.layout.Declare(name, sensor, role, status);
  problem.motions.push_back({sensor, OwnedMotion(role.geometry, state.process), {prior.block}});
  problem.priors.push_back(std::move(prior));
  return problem.priors.back().block;
}

State Problem::InitialState(bool reserved) const {
  State state(layout);
  std::vector<const Prior*> sorted_priors;
  for (const Prior& prior : priors) sorted_priors.push_back(&prior);
  std::ranges::stable_sort(sorted_priors, {}, &Prior::block);
  for (const Prior* const entry : sorted_priors) {
    const Prior& prior = *entry;
    if (!prior.sensor.empty() && reserved) state.Reserve(prior.block);
    if (!prior.sensor.empty()) continue;
    ALIDADE_EXPECTS(std::ssize(prior.mean) == layout[prior.block].geometry().ambient);
    state.Add(prior.block, prior.mean.data(), prior.covariance);
  }
  return state;
}

int Problem::FindSensor(std::string_view name) const {
  const auto found = std::find_if(sensors.begin(), sensors.end(),
                                  [name](const SensorBinding& s) { return s.name == name; });
  return found == sensors.end() ? -1 : static_cast<int>(found - sensors.begin());
}

BlockId internal::PositionBlockOf(const Problem& problem) {
  BlockId position = -1;
  for (const SensorBinding& binding : problem.sensors) {
    if (!binding.model->has_landmark()) continue;
    for (std::size_t r = 0; r < binding.roles.size(); ++r) {
      const BlockId id = binding.roles[r].block;
      const bool is_position = binding.model->roles()[r].name == "position" && id >= 0;
      if (is_position && problem.layout[id].geometry().ambient == 3) position = id;
    }
  }
  return position;
}

std::string internal::UnitOf(const Problem& problem, BlockId id) {
  if (!problem.layout[id].space.unit.empty()) return problem.layout[id].space.unit;
  for (const SensorBinding& sensor : problem.sensors) {
    for (std::size_t r = 0; r < sensor.roles.size(); ++r) {
      if (sensor.roles[r].block == id) return sensor.model->roles()[r].unit;
    }
  }
  return {};
}

}  // namespace alidade
