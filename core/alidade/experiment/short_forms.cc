// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/short_forms.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "alidade/base/text.h"
#include "alidade/config/tree.h"
#include "alidade/experiment/estimator_plugin.h"
#include "alidade/experiment/estimator_registry.h"
#include "alidade/experiment/name_in_entry.h"
#include "alidade/experiment/read_problem.h"
#include "alidade/plugin/built_in_models.h"

namespace alidade {
namespace {

using internal::Child;
using internal::FailAt;
using internal::FillCopy;
using internal::FillMap;
using internal::FillNumbers;
using internal::FillText;
using internal::Join;
using internal::KeyPlace;
using internal::kFormula;
using internal::NameInEntry;
using internal::PathOf;
using internal::Quoted;
using internal::Remove;

/// Returns the map `key` of `map`, or null if `map` does not contain such a map.
ConfigTree* ChildMap(const ConfigTree& map, std::string_view key) {
  ConfigTree* const child = Child(map, key);
  return child != nullptr && child->kind == Node::Kind::kMap ? child : nullptr;
}

/// Returns the scalar `key` of `map`, or null if `map` does not contain such a scalar.
ConfigTree* ChildText(const ConfigTree& map, std::string_view key) {
  ConfigTree* const child = Child(map, key);
  return child != nullptr && child->kind == Node::Kind::kScalar ? child : nullptr;
}

/// Returns the first component of each key that an estimator of this type reads.
std::set<std::string> KeysOfType(const std::string& type, const PluginHost& host) {
  std::set<std::string> keys;
  const auto add = [&](const std::vector<ParamInfo>& schema) {
    for (const ParamInfo& info : schema) keys.insert(info.key.substr(0, info.key.find('.')));
  };
  add(internal::CommonEstimatorKeys());
  if (const auto* const built_in = internal::FindEstimatorType(type)) add(built_in->schema());
  for (const PluginEntry& entry : host.entries()) {
    if (entry.kind == kEstimatorKind && entry.name == type) add(EstimatorSchema(entry));
  }
  return keys;
}

/// Moves the keys of the map `defaults` into the estimators whose types have these keys. Rejects
/// keys that neither these types nor a built-in type have. An estimator without a type has the type
/// of `defaults`, or else the type that its name states.
void ExpandEstimators(ConfigTree& root, const PluginHost& host) {
  const ConfigTree* const estimators = ChildMap(root, "estimators");
  if (estimators == nullptr) return;
  const ConfigTree* const defaults = Child(root, "defaults");
  if (defaults != nullptr) Node(defaults).ExpectMap("{gate: 0.999}");
  const ConfigTree* const type = defaults == nullptr ? nullptr : Child(*defaults, "type");
  std::set<std::string> known_keys;
  for (const auto& entry : estimators->children) {
    if (entry->kind != Node::Kind::kMap) continue;
    if (type != nullptr) FillCopy(*entry, *type);
    if (Child(*entry, "type") == nullptr) FillText(*entry, "type", entry->key);
    if (defaults == nullptr) continue;
    const std::set<std::string> keys = KeysOfType(Child(*entry, "type")->text, host);
    known_keys.insert(keys.begin(), keys.end());
    for (const auto& value : defaults->children) {
      if (keys.contains(value->key)) FillCopy(*entry, *value);
    }
  }
  if (defaults == nullptr) return;
  for (const auto& built_in : internal::EstimatorTypes()) {
    known_keys.merge(KeysOfType(built_in.name, host));
  }
  for (const auto& value : defaults->children) {
    if (known_keys.contains(value->key)) continue;
    const std::string nearest = Nearest(value->key, known_keys);
    FailAt(KeyPlace(*value), PathOf(*value), "no type of estimator has this key",
           nearest.empty() ? "one of " + Join({known_keys.begin(), known_keys.end()}) : "",
           nearest);
  }
  Remove(root, "defaults");
}

/// Replaces `exact` by the mean and the sigma 0. Adds `mean` to a map that contains neither a mean
/// nor `from_measurement`.
void ExpandInitial(ConfigTree* value, const std::vector<double>& mean) {
  if (value == nullptr) return;
  if (value->kind == Node::Kind::kScalar && value->text == "exact") {
    FillMap(*value);
    FillNumbers(*value, "mean", mean);
    FillNumbers(*value, "sigma", {0.0});
  } else if (value->kind == Node::Kind::kMap && Child(*value, "mean") == nullptr &&
             Child(*value, "from_measurement") == nullptr) {
    FillNumbers(*value, "mean", mean);
  }
}

/// Expands the initial values of the state entries. Returns their blocks.
StateLayout ExpandStates(const ConfigTree& root, const PluginHost& host) {
  StateLayout blocks;
  const ConfigTree* const state = ChildMap(root, "state");
  if (state == nullptr) return blocks;
  for (const auto& entry : state->children) {
    if (entry->kind != Node::Kind::kMap) continue;
    const ConfigTree* const model = ChildText(*entry, "model");
    if (model == nullptr) continue;
    const SharedMotion motion = CreateStateModel(model->text, Node(entry.get()), host);
    const bool has_equations = internal::HasEquationsInConfig(model->text);
    const ConfigTree* const renamed = has_equations ? nullptr : ChildMap(*entry, "blocks");
    const ConfigTree* const initial = ChildMap(*entry, "initial");
    for (const Space& block : motion->blocks()) {
      const ConfigTree* const new_name =
          renamed == nullptr ? nullptr : ChildText(*renamed, block.name);
      const std::string& name = new_name == nullptr ? block.name : new_name->text;
      if (initial != nullptr) ExpandInitial(Child(*initial, name), block.geometry.Identity());
      const std::string full_name = entry->key + '.' + name;
      if (blocks.Find(full_name) < 0) blocks.Declare(full_name, entry->key, block);
    }
  }
  return blocks;
}

/// Returns whether the units do not differ. A unit that is not declared is not compared.
bool HasUnitOf(const Space& block, const Space& role) {
  return block.unit.empty() || role.unit.empty() || block.unit == role.unit;
}

/// Returns the blocks of the entries in `roles`, which is the name of a state entry or a list of
/// such names.
std::vector<Block> BlocksOf(const Node& roles, const StateLayout& blocks) {
  std::vector<Block> offered;
  for (const Node& item : roles.ItemsOrOne()) {
    const std::string entry = item.Text();
    const std::size_t count = offered.size();
    std::ranges::copy_if(blocks.blocks(), std::back_inserter(offered),
                         [&](const Block& block) { return block.owner == entry; });
    if (offered.size() > count) continue;
    std::set<std::string> entries;
    for (const Block& block : blocks.blocks()) entries.insert(block.owner);
    item.Fail("state entry " + Quoted(entry) + " does not exist",
              Join({entries.begin(), entries.end()}) + ", or a map {ROLE: ENTRY.BLOCK}",
              Nearest(entry, entries));
  }
  return offered;
}

/// Returns whether a state entry may fill the role: it belongs neither to a landmark nor to the
/// sensor.
bool IsOfEntry(const Space& role) {
  return !role.landmark() && (role.flags & ALIDADE_ROLE_OWNED) == 0;
}

/// Rejects a role that `matching`, the blocks of its name, geometry and unit, do not determine.
[[noreturn]] void FailRole(const Node& roles, const Space& role, const SensorModel& model,
                           const std::vector<std::string>& matching,
                           const std::vector<Block>& offered) {
  std::vector<std::string> candidates = matching;
  for (const Block& block : offered) {
    if (matching.empty() && HasUnitOf(block.space, role)) candidates.push_back(block.name);
  }
  const std::string of_role = " role '" + role.name + "' of model '" + model.name() + "' (" +
                              role.unit + (role.unit.empty() ? "" : ": ") + role.doc +
                              ") in name, geometry and unit";
  roles.Fail((matching.empty() ? "no block matches" : "several blocks match") + of_role,
             "a map with " + role.name + ": " +
                 (candidates.empty() ? "ENTRY.BLOCK" : Join(candidates, " or ")));
}

/// Binds the roles of `model` to the blocks `offered`. A role is bound to the block that has its
/// name, its geometry and a unit that does not differ. If only one block is offered, and no role
/// has its name, it is bound to the first role that the model needs; ReadProblem then checks it.
void BindRoles(ConfigTree& roles, const SensorModel& model, const std::vector<Block>& offered) {
  std::map<std::string, std::string> bound;  // role -> block
  for (const Space& role : model.roles()) {
    std::vector<std::string> matching;
    for (const Block& block : offered) {
      const bool matches = NameInEntry(block) == role.name && block.geometry() == role.geometry;
      if (matches && HasUnitOf(block.space, role)) matching.push_back(block.name);
    }
    if (!IsOfEntry(role) || matching.empty()) continue;
    if (matching.size() > 1) FailRole(Node(&roles), role, model, matching, offered);
    bound[role.name] = matching.front();
  }
  for (const Space& role : model.roles()) {
    if (!IsOfEntry(role) || role.optional() || bound.contains(role.name)) continue;
    const bool is_only = offered.size() == 1 && bound.empty();
    if (!is_only) FailRole(Node(&roles), role, model, {}, offered);
    bound[role.name] = offered.front().name;
  }
  FillMap(roles);
  for (const Space& role : model.roles()) {
    if (bound.contains(role.name)) FillText(roles, role.name, bound[role.name]);
  }
}

/// Binds each block to a role of the same name, if no earlier block has this name. Omits blocks
/// without a matrix if the sensor has a map `matrices`.
void BindEachBlock(ConfigTree& roles, const std::vector<Block>& offered,
                   const ConfigTree* matrices) {
  FillMap(roles);
  for (const Block& block : offered) {
    const std::string role = NameInEntry(block);
    const bool is_needed = matrices == nullptr || Child(*matrices, role) != nullptr;
    if (is_needed && Child(roles, role) == nullptr) FillText(roles, role, block.name);
  }
}

/// Adds the role `landmark` and the means of the states that the sensor owns.
void FillFromModel(ConfigTree& entry, const SensorModel& model) {
  ConfigTree* const roles = ChildMap(entry, "roles");
  if (roles != nullptr && model.has_landmark() && Child(*roles, "landmark") == nullptr) {
    FillText(*roles, "landmark", "landmarks");
  }
  const ConfigTree* const initial = ChildMap(entry, "initial");
  if (initial == nullptr) return;
  for (std::size_t i = 0; i < model.roles().size(); ++i) {
    const Space& role = model.roles()[i];
    if ((role.flags & ALIDADE_ROLE_OWNED) == 0) continue;
    ExpandInitial(Child(*initial, role.name), model.owned(i).mean);
  }
}

void ExpandSensor(ConfigTree& entry, const PluginHost& host, const StateLayout& blocks) {
  ExpandInitial(ChildMap(entry, "time_offset_s"), {0.0});
  const ConfigTree* const model_name = ChildText(entry, "model");
  ConfigTree* const roles = Child(entry, "roles");
  if (model_name == nullptr || roles == nullptr) return;
  std::vector<Block> offered;
  const bool has_names = roles->kind == Node::Kind::kScalar || roles->kind == Node::Kind::kList;
  if (has_names) {
    offered = BlocksOf(Node(roles), blocks);
    BindEachBlock(*roles, offered, ChildMap(entry, "H"));
  }
  const bool has_equations = internal::HasEquationsInConfig(model_name->text);
  if (roles->kind != Node::Kind::kMap) return;
  const std::vector<Space> bound = BoundRoles(Node(roles), blocks);
  const std::size_t landmarks = Child(*roles, "landmark") == nullptr ? 0 : 1;
  // The reader reports a block that does not exist.
  if (has_equations && bound.size() + landmarks < roles->children.size()) return;
  const SharedSensor model = CreateBoundSensor(model_name->text, Node(&entry), bound, host);
  if (has_names && !has_equations) BindRoles(*roles, *model, offered);
  FillFromModel(entry, *model);
}

void ExpandSensors(const ConfigTree& root, const PluginHost& host, const StateLayout& blocks) {
  const ConfigTree* const sensors = ChildMap(root, "sensors");
  if (sensors == nullptr || blocks.blocks().empty()) return;  // the reader reports both
  for (const auto& entry : sensors->children) {
    if (entry->kind == Node::Kind::kMap) ExpandSensor(*entry, host, blocks);
  }
}

/// Replaces `distance_m: [NEAR, FAR]` by the Gaussian of the inverse distance whose mean -+ 2 sigma
/// are 1 / FAR and 1 / NEAR. If FAR is `none`, 1 / FAR is 0, as in [Civera2008].
void ExpandPrior(ConfigTree& prior) {
  const ConfigTree* const distance = Child(prior, "distance_m");
  if (distance == nullptr) return;
  for (const char* const key : {"inverse_distance", "sigma"}) {
    const ConfigTree* const other = Child(prior, key);
    if (other == nullptr) continue;
    if (!other->is_filled) {
      FailAt(KeyPlace(*other), PathOf(*other), "the prior is also defined by `distance_m`",
             "distance_m, or inverse_distance and sigma");
    }
    Remove(prior, key);
  }
  constexpr const char* kExpected = "[NEAR, FAR] in m, or [NEAR, none]";
  const Node node(distance);
  if (node.kind() != Node::Kind::kList) node.Fail("the value is not a list", kExpected);
  const std::vector<Node> items = node.Items();
  if (items.size() != 2) node.Fail("the list does not have 2 items", kExpected);
  constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  const double near_m = items[0].Number(0.0, kNoLimit, true, true, "m");
  const bool is_bounded = items[1].kind() != Node::Kind::kScalar || items[1].Text() != "none";
  const double nearest = 1.0 / near_m;
  const double farthest =
      is_bounded ? 1.0 / items[1].Number(near_m, kNoLimit, true, true, "m") : 0.0;
  constexpr double kSigmas = 4.0;  // from mean - 2 sigma to mean + 2 sigma
  FillNumbers(prior, "inverse_distance", {(nearest + farthest) / 2.0});
  FillNumbers(prior, "sigma", {(nearest - farthest) / kSigmas});
  Remove(prior, "distance_m");
}

}  // namespace

void ExpandShortForms(Config& config, const PluginHost& host) {
  ConfigTree& root = config.tree();
  ExpandEstimators(root, host);
  const StateLayout blocks = ExpandStates(root, host);
  ExpandSensors(root, host, blocks);
  if (const ConfigTree* const landmarks = ChildMap(root, "landmarks")) {
    if (ConfigTree* const prior = ChildMap(*landmarks, "prior")) ExpandPrior(*prior);
  }
}

}  // namespace alidade
