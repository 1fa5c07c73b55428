// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/system.h"

#include <algorithm>
#include <cmath>

#include "alidade/base/all_finite.h"
#include "alidade/base/error.h"
#include "alidade/base/words.h"
#include "alidade/estimation/owned_state.h"

namespace alidade {
namespace {

using internal::NamesOf;

[[noreturn]] void Refuse(const std::string& who, const std::string& why) {
  throw Error(ExitCode::kBadConfig, who + ' ' + why);
}

/// Mean and covariance of a block, checked.
Prior PriorOf(const InitialValue& initial, const Space& space, BlockId block,
              const std::string& who) {
  Prior prior{block, initial.mean, {}, initial.from};
  if (!initial.from.empty()) return prior;
  const Geometry& geometry = space.geometry;
  const std::string value =
      "the initial value of '" + space.name + "', " + internal::WithArticle(ToString(geometry));
  if (std::ssize(prior.mean) != geometry.ambient) {
    Refuse(who, "needs " + std::to_string(geometry.ambient) + " numbers as " + value + ", not " +
                    std::to_string(prior.mean.size()));
  }
  if (!internal::AllFinite(prior.mean)) Refuse(who, "has numbers that are not finite in " + value);
  if (DistanceFrom(geometry, prior.mean.data()) > kUnitTolerance) {
    Refuse(who, "has a length that is not 1 in " + value);
  }
  geometry.Normalise(prior.mean.data());
  if (initial.status == BlockStatus::kConstant) return prior;
  const int n = geometry.tangent;
  std::vector<double> sigma = initial.sigma;
  if (sigma.size() == 1) sigma.assign(static_cast<std::size_t>(n), sigma[0]);
  const auto good = [](double one) { return std::isfinite(one) && one >= 0.0; };
  if (std::ssize(sigma) != n || !std::ranges::all_of(sigma, good)) {
    Refuse(who, "needs a finite standard deviation of at least 0, or " + std::to_string(n) +
                    " of them, with " + value);
  }
  prior.covariance = Eigen::Map<const Eigen::VectorXd>(sigma.data(), n).cwiseAbs2().asDiagonal();
  return prior;
}

/// The state `SENSOR.ROLE` that a sensor brings with it, as its model says.
BlockId AddOwnedState(System& system, const std::string& sensor, const Space& role,
                      OwnedRole owned) {
  const bool constant = owned.sqrt_prior.empty();
  const BlockId id =
      system.layout.Declare(sensor + '.' + role.name, sensor, role,
                            constant ? BlockStatus::kConstant : BlockStatus::kEstimated);
  Prior prior{id, owned.mean, {}, {}};
  if (constant) {
    owned.dynamics = OwnedDynamics::kConstant;
  } else {
    const int n = role.geometry.tangent;
    const Eigen::Map<const RowMajor> root(owned.sqrt_prior.data(), n, n);
    prior.covariance = root * root.transpose();
  }
  system.priors.push_back(std::move(prior));
  system.motions.push_back({sensor, internal::OwnedMotion(role.geometry, owned), {id}});
  return id;
}

/// Refuses a block that cannot fill a role.
void CheckRole(const System& system, const Space& role, const RoleBinding& binding,
               const std::string& who) {
  const std::string its_role =
      "role '" + role.name + "', " + internal::WithArticle(ToString(role.geometry));
  if (binding.block < 0) {
    if (!role.optional()) Refuse(who, "needs a block that fills its " + its_role);
    return;
  }
  ALIDADE_EXPECTS(binding.block < std::ssize(system.layout.blocks()));
  const Block& block = system.layout[binding.block];
  if (block.geometry() == role.geometry) return;
  Refuse(who, "has a " + its_role + "; block '" + block.name + "' is " +
                  internal::WithArticle(ToString(block.geometry())));
}

}  // namespace

InitialValue::InitialValue(std::string name, std::vector<double> at, std::vector<double> deviations,
                           BlockStatus use)
    : block(std::move(name)), mean(std::move(at)), sigma(std::move(deviations)), status(use) {}

InitialValue::InitialValue(std::string name, std::vector<double> at, double deviation,
                           BlockStatus use)
    : InitialValue(std::move(name), std::move(at), std::vector{deviation}, use) {}

InitialValue::InitialValue(std::string name, double at, double deviation, BlockStatus use)
    : InitialValue(std::move(name), std::vector{at}, std::vector{deviation}, use) {}

InitialValue InitialValue::Constant(std::string block, std::vector<double> value) {
  return {std::move(block), std::move(value), std::vector<double>(), BlockStatus::kConstant};
}

InitialValue InitialValue::FromMeasurement(std::string block, std::string sensor) {
  InitialValue initial(std::move(block), std::vector<double>(), std::vector<double>());
  initial.from = std::move(sensor);
  return initial;
}

BlockId StateHandle::operator[](std::string_view block) const {
  const auto found = blocks.find(block);
  if (found != blocks.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& [known, id] : blocks) names.push_back(known);
  Refuse("state '" + name + "'",
         "has no block '" + std::string(block) + "'; its blocks are " + internal::Join(names));
}

StateHandle System::AddState(const std::string& name, SharedMotion model,
                             const std::vector<InitialValue>& initial, double input_timeout_s) {
  const std::string who = "state '" + name + "'";
  const auto taken = [&](const Block& block) { return block.owner == name; };
  if (std::ranges::any_of(layout.blocks(), taken)) Refuse(who, "is there already");
  StateHandle handle{name, {}, -1};
  MotionBinding motion{name, std::move(model), {}, {}};
  const std::vector<Space>& spaces = motion.model->blocks();
  for (const InitialValue& one : initial) {
    if (std::ranges::count(spaces, one.block, &Space::name) == 0) {
      Refuse(who,
             "has no block '" + one.block + "'; its blocks are " + internal::Join(NamesOf(spaces)));
    }
  }
  std::vector<Prior> added;
  for (const Space& space : spaces) {
    const auto found = std::ranges::find(initial, space.name, &InitialValue::block);
    if (found == initial.end()) Refuse(who, "needs an initial value of '" + space.name + "'");
    added.push_back(PriorOf(*found, space, -1, who));
  }
  for (std::size_t i = 0; i < spaces.size(); ++i) {
    const auto found = std::ranges::find(initial, spaces[i].name, &InitialValue::block);
    const BlockId id = layout.Declare(name + '.' + spaces[i].name, name, spaces[i], found->status);
    handle.blocks.emplace(spaces[i].name, id);
    motion.blocks.push_back(id);
    added[i].block = id;
  }
  std::ranges::move(added, std::back_inserter(priors));
  if (motion.model->has_input()) {
    motion.input = {name + '.' + motion.model->input().name, input_timeout_s};
    handle.input = static_cast<int>(streams.size());
    streams.push_back({motion.input.stream, motion.model->input().geometry.ambient});
  }
  motions.push_back(std::move(motion));
  return handle;
}

SensorHandle System::AddSensor(const std::string& name, SharedSensor model,
                               std::vector<RoleBinding> roles, const SensorOptions& options) {
  const std::string who = "sensor '" + name + "'";
  if (FindSensor(name) >= 0) Refuse(who, "is there already");
  const std::vector<Space>& spaces = model->roles();
  const auto of_landmark = std::ranges::count_if(spaces, &Space::landmark);
  const auto own = std::ssize(spaces) - of_landmark;
  if (std::ssize(roles) > own) {
    Refuse(who, "has " + std::to_string(own) + (own == 1 ? " role" : " roles") +
                    " to be filled, not " + std::to_string(roles.size()) + ": " +
                    internal::Join(NamesOf(spaces)));
  }
  roles.resize(spaces.size());
  for (std::size_t i = 0; i < spaces.size(); ++i) {
    const bool owned = (spaces[i].flags & ALIDADE_ROLE_OWNED) != 0;
    if (spaces[i].landmark() || (owned && roles[i].block < 0)) continue;
    CheckRole(*this, spaces[i], roles[i], who);
  }
  for (std::size_t i = 0; i < spaces.size(); ++i) {
    const bool owned = (spaces[i].flags & ALIDADE_ROLE_OWNED) != 0;
    if (owned && roles[i].block < 0)
      roles[i] = AddOwnedState(*this, name, spaces[i], model->owned(i));
  }
  if (of_landmark > 0 && !landmarks) landmarks.emplace();
  const SensorHandle handle{static_cast<int>(sensors.size()), static_cast<int>(streams.size())};
  streams.push_back({name, model->measurement().geometry.ambient, 0.0, model->known_size()});
  sensors.push_back({name, name, std::move(model), std::move(roles), options.loss, options.xyz,
                     options.outlier_rejection});
  return handle;
}

State System::InitialState(bool reserved) const {
  State state(layout);
  std::vector<const Prior*> in_order;
  for (const Prior& prior : priors) in_order.push_back(&prior);
  std::ranges::stable_sort(in_order, {}, &Prior::block);
  for (const Prior* const one : in_order) {
    const Prior& prior = *one;
    if (!prior.from.empty() && reserved) state.Reserve(prior.block);
    if (!prior.from.empty()) continue;
    ALIDADE_EXPECTS(std::ssize(prior.mean) == layout[prior.block].geometry().ambient);
    state.Add(prior.block, prior.mean.data(), prior.covariance);
  }
  return state;
}

int System::FindSensor(std::string_view name) const {
  const auto found = std::find_if(sensors.begin(), sensors.end(),
                                  [name](const SensorBinding& s) { return s.name == name; });
  return found == sensors.end() ? -1 : static_cast<int>(found - sensors.begin());
}

BlockId internal::PositionBlockOf(const System& system) {
  BlockId path = -1;
  for (const SensorBinding& binding : system.sensors) {
    if (!binding.model->has_landmark()) continue;
    for (std::size_t r = 0; r < binding.roles.size(); ++r) {
      const BlockId id = binding.roles[r].block;
      const bool position = binding.model->roles()[r].name == "position" && id >= 0;
      if (position && system.layout[id].geometry().ambient == 3) path = id;
    }
  }
  return path;
}

std::string internal::UnitOf(const System& system, BlockId id) {
  if (!system.layout[id].space.unit.empty()) return system.layout[id].space.unit;
  for (const SensorBinding& sensor : system.sensors) {
    for (std::size_t r = 0; r < sensor.roles.size(); ++r) {
      if (sensor.roles[r].block == id) return sensor.model->roles()[r].unit;
    }
  }
  return {};
}

}  // namespace alidade
