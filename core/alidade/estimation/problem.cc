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
  if (initial.covariance.size() > 0) {
    constexpr double kRounding = 1e-11;  // over the largest variance
    prior.covariance = initial.covariance;
    const bool fits = prior.covariance.rows() == n && prior.covariance.cols() == n &&
                      prior.covariance.allFinite() &&
                      prior.covariance.isApprox(prior.covariance.transpose());
    Eigen::LDLT<Eigen::MatrixXd> ldlt;
    Eigen::MatrixXd root;
    if (!fits || internal::SquareRootOf(prior.covariance, ldlt, root) < -kRounding) {
      Refuse(who, "needs a symmetric, positive semi-definite covariance of " + std::to_string(n) +
                      " x " + std::to_string(n) + " finite numbers with " + value);
    }
    return prior;
  }
  std::vector<double> sigma = initial.sigma;
  if (sigma.size() == 1) sigma.assign(static_cast<std::size_t>(n), sigma[0]);
  const auto good = [](double one) { return std::isfinite(one) && one >= 0.0; };
  if (std::ssize(sigma) != n || !std::ranges::all_of(sigma, good)) {
    Refuse(who, "needs a finite standard deviation of at least 0" +
                    (n == 1 ? "" : ", or " + std::to_string(n) + " of them,") + " with " + value);
  }
  prior.covariance = Eigen::Map<const Eigen::VectorXd>(sigma.data(), n).cwiseAbs2().asDiagonal();
  return prior;
}

/// The index of the stream, a new one if the problem reads none of that name.
int AddStream(Problem& problem, const StreamInfo& stream, const std::string& who) {
  const auto found = std::ranges::find(problem.streams, stream.name, &StreamInfo::name);
  if (found == problem.streams.end()) {
    problem.streams.push_back(stream);
    return static_cast<int>(problem.streams.size()) - 1;
  }
  if (found->size != stream.size || found->known != stream.known) {
    const auto numbers = [](const StreamInfo& one) {
      return std::to_string(one.size) + " and " + std::to_string(one.known) + " known numbers";
    };
    Refuse(who, "reads " + numbers(stream) + " from stream '" + stream.name + "', and another " +
                    numbers(*found));
  }
  return static_cast<int>(found - problem.streams.begin());
}

/// Refuses a block that cannot fill a role.
void CheckRole(const Problem& problem, const Space& role, const RoleBinding& binding,
               const std::string& who) {
  const std::string its_role =
      "role '" + role.name + "', " + internal::WithArticle(ToString(role.geometry));
  if (binding.block < 0) {
    if (!role.optional()) Refuse(who, "needs a block that fills its " + its_role);
    return;
  }
  if (binding.block >= std::ssize(problem.layout.blocks())) {
    Refuse(who, "has in its " + its_role + ", a block that is not of this problem");
  }
  const Block& block = problem.layout[binding.block];
  if (block.geometry() == role.geometry) return;
  Refuse(who, "has a " + its_role + "; block '" + block.name + "' is " +
                  internal::WithArticle(ToString(block.geometry())));
}

}  // namespace

InitialValue::InitialValue(std::string of_block, std::vector<double> at,
                           std::vector<double> deviations, BlockStatus use)
    : block(std::move(of_block)), mean(std::move(at)), sigma(std::move(deviations)), status(use) {}

InitialValue::InitialValue(std::string of_block, std::vector<double> at, double deviation,
                           BlockStatus use)
    : InitialValue(std::move(of_block), std::move(at), std::vector{deviation}, use) {}

InitialValue::InitialValue(std::string of_block, double at, double deviation, BlockStatus use)
    : InitialValue(std::move(of_block), std::vector{at}, std::vector{deviation}, use) {}

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
  initial.from = std::move(sensor);
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
  for (const auto& [known, id] : blocks) names.push_back(known);
  Refuse("state '" + name + "'",
         "has no block '" + std::string(block) + "'; its blocks are " + internal::Join(names));
}

StateHandle Problem::AddState(const std::string& name, SharedMotion model,
                              const std::vector<InitialValue>& initial, const InputBinding& input) {
  const std::string who = "state '" + name + "'";
  const auto taken = [&](const Block& block) { return block.owner == name; };
  if (std::ranges::any_of(layout.blocks(), taken)) Refuse(who, "is there already");
  const std::vector<Space>& spaces = model->blocks();
  for (const InitialValue& one : initial) {
    if (std::ranges::count(initial, one.block, &InitialValue::block) > 1) {
      Refuse(who, "has two initial values of '" + one.block + "'");
    }
    if (std::ranges::count(spaces, one.block, &Space::name) == 0) {
      Refuse(who,
             "has no block '" + one.block + "'; its blocks are " + internal::Join(NamesOf(spaces)));
    }
  }
  std::vector<InitialValue> values;  // in the order of the model
  std::vector<Prior> added;
  for (const Space& space : spaces) {
    const auto found = std::ranges::find(initial, space.name, &InitialValue::block);
    if (found != initial.end()) {
      values.push_back(*found);
    } else if ((space.flags & ALIDADE_ROLE_OWNED) != 0) {
      std::vector<double> neutral(static_cast<std::size_t>(space.geometry.ambient));
      space.geometry.Identity(neutral.data());
      values.push_back(InitialValue::Constant(space.name, neutral));
    } else {
      Refuse(who, "needs an initial value of '" + space.name + "'");
    }
    if (values.back().name.empty()) values.back().name = space.name;
    added.push_back(PriorOf(values.back(), space, -1, who));
  }
  if (!input.stream.empty() && !model->has_input()) {
    Refuse(who, "has model '" + model->name() + "', which takes no control input");
  }
  Problem changed = *this;  // as a whole, or nothing
  StateHandle handle{name, {}, -1};
  MotionBinding motion{name, std::move(model), {}, {}};
  for (std::size_t i = 0; i < spaces.size(); ++i) {
    const std::string& block = values[i].name;
    const std::string full = name + '.' + block;
    if (changed.layout.Find(full) >= 0) Refuse(who, "has a block '" + full + "', which is there");
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
    handle.input = AddStream(changed, {motion.input.stream, space.geometry.ambient}, who);
  }
  changed.motions.push_back(std::move(motion));
  *this = std::move(changed);
  return handle;
}

SensorHandle Problem::AddSensor(const std::string& name, SharedSensor model,
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
  const auto brings = [&](std::size_t i) {
    return (spaces[i].flags & ALIDADE_ROLE_OWNED) != 0 && roles[i].block < 0;
  };
  for (std::size_t i = 0; i < spaces.size(); ++i) {
    if (!spaces[i].landmark() && !brings(i)) CheckRole(*this, spaces[i], roles[i], who);
    const BlockId block = roles[i].block;
    if (block < 0 || std::ranges::count(roles, block, &RoleBinding::block) < 2) continue;
    Refuse(who, "has block '" + layout[block].name + "' in two roles; expected one for each");
  }
  for (const auto& [role, state] : options.owned) {
    if (role < spaces.size() && brings(role)) continue;
    Refuse(who, "brings no state in its role " + std::to_string(role) +
                    ", which the option `owned` names");
  }
  if (options.loss.kind != LossKind::kNone && !(options.loss.scale > 0.0)) {
    Refuse(who, "has a robust loss of scale " + internal::RoundedText(options.loss.scale) +
                    "; expected > 0");
  }
  Problem changed = *this;  // as a whole, or nothing
  for (std::size_t i = 0; i < spaces.size(); ++i) {
    if (!brings(i)) continue;
    const auto given = options.owned.find(i);
    roles[i] = internal::AddOwnedState(
        changed, name, spaces[i],
        given != options.owned.end() ? given->second : OwnedState::Of(model->owned(i)));
  }
  if (of_landmark > 0 && !changed.landmarks) changed.landmarks.emplace();
  const std::string& stream = options.stream.empty() ? name : options.stream;
  const SensorHandle handle{
      static_cast<int>(sensors.size()),
      AddStream(changed, {stream, model->measurement().geometry.ambient, 0.0, model->known_size()},
                who)};
  changed.sensors.push_back({name, stream, std::move(model), std::move(roles), options.loss,
                             options.xyz, options.outlier_rejection});
  *this = std::move(changed);
  return handle;
}

BlockId internal::AddOwnedState(Problem& problem, const std::string& sensor, const Space& role,
                                OwnedState state) {
  const std::string who = "sensor '" + sensor + "'";
  if (!state.initial.from.empty()) {
    Refuse(who, "brings the state '" + role.name + "', which starts from no measurement");
  }
  const std::string name = sensor + '.' + role.name;
  if (problem.layout.Find(name) >= 0)
    Refuse(who, "brings the state '" + name + "', which is there");
  Prior prior = PriorOf(state.initial, role, -1, who);
  const BlockStatus status = state.initial.status;
  if (status == BlockStatus::kConstant) state.process.dynamics = OwnedDynamics::kConstant;
  state.process.mean = prior.mean;
  state.process.sqrt_prior.clear();
  OwnedRole checked = state.process;
  const std::string defect = CheckOwned(role.geometry, checked);
  if (!defect.empty()) {
    Refuse(who, "brings the state '" + role.name + "', whose dynamics " + defect);
  }
  prior.block = problem.layout.Declare(name, sensor, role, status);
  problem.motions.push_back({sensor, OwnedMotion(role.geometry, state.process), {prior.block}});
  problem.priors.push_back(std::move(prior));
  return problem.priors.back().block;
}

State Problem::InitialState(bool reserved) const {
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

int Problem::FindSensor(std::string_view name) const {
  const auto found = std::find_if(sensors.begin(), sensors.end(),
                                  [name](const SensorBinding& s) { return s.name == name; });
  return found == sensors.end() ? -1 : static_cast<int>(found - sensors.begin());
}

BlockId internal::PositionBlockOf(const Problem& problem) {
  BlockId path = -1;
  for (const SensorBinding& binding : problem.sensors) {
    if (!binding.model->has_landmark()) continue;
    for (std::size_t r = 0; r < binding.roles.size(); ++r) {
      const BlockId id = binding.roles[r].block;
      const bool position = binding.model->roles()[r].name == "position" && id >= 0;
      if (position && problem.layout[id].geometry().ambient == 3) path = id;
    }
  }
  return path;
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
