// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/read_problem.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <span>
#include <utility>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/config/read_covariance.h"
#include "alidade/config/tree.h"
#include "alidade/estimation/owned_state.h"
#include "alidade/estimation/time_offset.h"
#include "alidade/experiment/defect_node.h"
#include "alidade/experiment/read_landmarks.h"
#include "alidade/formula/models_in_config.h"
#include "alidade/plugin/built_in_models.h"
#include "alidade/state/element_names.h"
#include "alidade/state/quaternion_sign.h"

namespace alidade {
namespace {

using internal::NamesOf;

/// Calls `add`. If `add` throws, throws the error again with the place of the entry.
template <class Add>
void AddAt(const Node& entry, const Add& add) {
  try {
    add();
  } catch (const Error& e) {
    entry.Fail(e.what());
  }
}

/// Returns the neutral element of a geometry as a map of its elements, as in `{w: 1, x: 0, y: 0, z:
/// 0}`.
std::string IdentityMap(const Geometry& geometry) {
  const std::vector<std::string> elements = internal::SplitNames(geometry.row().elements);
  const std::vector<double> identity = geometry.Identity();
  std::string map;
  for (std::size_t i = 0; i < elements.size(); ++i) {
    map += (i == 0 ? "" : ", ") + elements[i] + (identity[i] == 0.0 ? ": 0" : ": 1");
  }
  return '{' + map + '}';
}

/// Returns the unit quaternion w, x, y, z of R = Rz(yaw) Ry(pitch) Rx(roll).
std::array<double, 4> QuaternionOf(const std::vector<double>& rpy_deg) {
  constexpr double kHalfRadian = std::numbers::pi / 360.0;  // half of a degree
  const auto turn = [&](std::size_t axis) {
    Eigen::Quaterniond q(std::cos(kHalfRadian * rpy_deg[axis]), 0.0, 0.0, 0.0);
    q.vec()[static_cast<Eigen::Index>(axis)] = std::sin(kHalfRadian * rpy_deg[axis]);
    return q;
  };
  const Eigen::Quaterniond q = turn(2) * turn(1) * turn(0);
  return {q.w(), q.x(), q.y(), q.z()};
}

/// Reads a map of the elements of a geometry that contains a unit quaternion. The key `rpy_deg` may
/// replace the elements of the quaternion.
std::vector<double> ReadElements(const Node& node, const Geometry& geometry) {
  node.ExpectMap(IdentityMap(geometry) +
                 ", with rpy_deg: [ROLL, PITCH, YAW] in place of a quaternion, or a list");
  const auto angles = node.Find("rpy_deg");
  const auto rotation = QuaternionOf(angles ? angles->Numbers(3, "deg") : std::vector(3, 0.0));
  const auto first = static_cast<std::size_t>(geometry.row().quaternion);
  std::vector<double> value;
  for (const std::string& element : internal::SplitNames(geometry.row().elements)) {
    const std::size_t i = value.size() - first;  // large for an element before the quaternion
    const bool is_given = angles && i < rotation.size();
    value.push_back(is_given ? rotation[i] : node.At(element).Number());
  }
  node.RejectUnread();
  return value;
}

/// Returns the unit of the standard deviations of a block, or "" if its elements differ in units.
std::string SigmaUnit(const Space& space) {
  const bool has_one_unit = space.geometry.is_vector() || space.geometry.is_angular();
  if (!space.parts.empty() || !has_one_unit) return {};
  return space.geometry.tangent < space.geometry.ambient ? "rad" : space.unit;
}

/// Reads exactly one of `sigma` and `covariance`.
Eigen::MatrixXd ReadCovariance(const Node& node, const Space& space) {
  const int size = space.geometry.tangent;
  const auto sigma = node.Find("sigma"), covariance = node.Find("covariance");
  if (!sigma && !covariance) {
    node.RejectUnread();
    node.Fail("the uncertainty of the initial value is missing",
              "sigma, a standard deviation, or covariance, a matrix");
  }
  if (sigma && covariance) {
    covariance->Fail("the uncertainty is also defined by `sigma`", "one of the two keys");
  }
  if (covariance) {
    const std::vector<double> values = internal::ReadCovariance(*covariance, size);
    return Eigen::Map<const Eigen::MatrixXd>(values.data(), size, size);
  }
  const std::vector<double> sigmas = internal::ReadSigmas(*sigma, size, SigmaUnit(space));
  return Eigen::Map<const Eigen::VectorXd>(sigmas.data(), size).cwiseAbs2().asDiagonal();
}

/// Reads a list of block names, such as `consider: [depth]`. Rejects a name that `accepted` does
/// not contain.
std::vector<std::string> ReadNames(const Node& entry, const char* key,
                                   const std::vector<std::string>& accepted) {
  std::vector<std::string> names;
  const auto list = entry.Find(key);
  if (!list) return names;
  for (const Node& item : list->Items()) {
    const std::string name = item.Text();
    if (std::find(accepted.begin(), accepted.end(), name) == accepted.end()) {
      item.Fail("this entry has no block '" + name + "'", internal::Join(accepted),
                Nearest(name, accepted));
    }
    names.push_back(name);
  }
  return names;
}

bool Contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// Returns the names of the blocks in the order of the model. Replaces the names of the blocks that
/// the entry renames.
std::vector<std::string> ReadBlockNames(const Node& entry, const MotionModel& model) {
  std::vector<std::string> names = NamesOf(model.blocks());
  const auto renamed = entry.Find("blocks");
  for (std::string& name : names) {
    const auto new_name = renamed ? renamed->Find(name) : std::nullopt;
    if (new_name) name = new_name->Text();
    internal::ExpectName(name, new_name.value_or(entry), "a block");
  }
  if (!renamed) return names;
  renamed->RejectUnread();
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (std::count(names.begin(), names.end(), names[i]) > 1) {
      renamed->Fail("two blocks have the name '" + names[i] + "'",
                    "a different name for each block");
    }
  }
  return names;
}

/// Returns an example of the initial value of a block, for messages.
std::string InitialExample(const Space& space) {
  if (space.geometry.row().quaternion >= 0) {
    return "{mean: " + IdentityMap(space.geometry) + ", sigma: 0.1}";
  }
  std::string mean = "0";
  for (int i = 1; i < space.geometry.ambient; ++i) mean += ", 0";
  return "{mean: " + (space.geometry.ambient > 1 ? '[' + mean + ']' : mean) + ", sigma: 0.1}";
}

/// Reads the initial value of the block `name` of the problem. `space` describes the block in the
/// model.
InitialValue ReadInitial(const Node& initial, const Space& space, const std::string& name,
                         BlockStatus status) {
  initial.ExpectMap(InitialExample(space));
  InitialValue value = InitialValue::Constant(space.name, {});
  value.name = name;
  value.status = status;
  if (const auto sensor = initial.Find("from_measurement")) {
    value.sensor = sensor->Text();
  } else {
    value.mean =
        ReadBlockValue(initial.At("mean", "the initial value", InitialExample(space)), space);
    if (status != BlockStatus::kConstant) {
      value.covariance = ReadCovariance(initial, space);
    } else {
      for (const char* key : {"sigma", "covariance"}) initial.Declare(key);
    }
  }
  initial.RejectUnread();
  return value;
}

/// Reads `input: {stream: NAME, timeout_s: S}`. Rejects this key if the model has no control input.
InputBinding ReadInput(const Node& entry, const MotionModel& model) {
  constexpr double kMaxSeconds = 1e9;
  InputBinding binding;
  if (!model.has_input()) {
    if (const auto input = entry.Find("input")) {
      input->Fail("model '" + model.name() + "' has no control input; remove this key");
    }
    return binding;
  }
  const std::string needed_by =
      "the control input " + model.input().name + " of model " + model.name();
  const Node input = entry.At("input", needed_by, "input: {stream: NAME}");
  input.ExpectMap("{stream: NAME}, or {stream: NAME, timeout_s: S}");
  binding.stream = input.At("stream", needed_by).Text();
  if (const auto timeout = input.Find("timeout_s")) {
    binding.timeout_s = timeout->Number(0.0, kMaxSeconds, true);
  }
  input.RejectUnread();
  return binding;
}

void ReadStateEntry(const std::string& name, const Node& entry, const PluginHost& host,
                    Problem& problem) {
  const std::string model_name = entry.At("model", "a state entry").Text();
  const SharedMotion model = CreateStateModel(model_name, entry, host);
  const InputBinding input = ReadInput(entry, *model);
  const std::vector<std::string> names = internal::HasEquationsInConfig(model_name)
                                             ? NamesOf(model->blocks())
                                             : ReadBlockNames(entry, *model);
  const auto considered = ReadNames(entry, "consider", names);
  const auto constant = ReadNames(entry, "constant", names);
  for (const std::string& block : constant) {
    if (!Contains(considered, block)) continue;
    entry.At("constant")
        .Fail("block '" + block + "' is also in `consider`",
              "the block in only one of `constant` (exact) and `consider` (uncertain)");
  }
  const std::string example = "{" + names[0] + ": " + InitialExample(model->blocks()[0]) + '}';
  const Node initial = entry.At("initial", "the state entry '" + name + "'", "initial: " + example);
  initial.ExpectMap(example);
  for (const std::string& block : names) initial.Declare(block);
  initial.RejectUnread();
  std::vector<InitialValue> values;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const Space& space = model->blocks()[i];
    const bool is_owned = (space.flags & ALIDADE_ROLE_OWNED) != 0;
    if (is_owned && !initial.Find(names[i]) && !Contains(considered, names[i])) {
      values.push_back(InitialValue::Constant(space.name, space.geometry.Identity()));
      values.back().name = names[i];
      continue;
    }
    const BlockStatus status = Contains(constant, names[i])     ? BlockStatus::kConstant
                               : Contains(considered, names[i]) ? BlockStatus::kConsider
                                                                : BlockStatus::kEstimated;
    const Node node = initial.At(names[i], "block '" + name + "." + names[i] + "'",
                                 names[i] + ": " + InitialExample(space));
    values.push_back(ReadInitial(node, space, names[i], status));
  }
  entry.RejectUnread();
  AddAt(entry, [&] { problem.AddState(name, model, values, input); });
}

/// Reads one standard deviation, or one for each of `size` elements. Returns the square root of the
/// covariance.
std::vector<double> ReadSqrtDiagonal(const Node& node, int size) {
  const std::vector<double> sigmas = internal::ReadSigmas(node, size);
  const std::size_t n = sigmas.size();
  std::vector<double> root(n * n, 0.0);
  for (std::size_t i = 0; i < n; ++i) root[i * n + i] = sigmas[i];
  return root;
}

/// Reads `constant`, {random_walk: SIGMA} or {gauss_markov: {sigma, time_constant_s}}. The sigma of
/// a random walk is its standard deviation after one second. The sigma of a Gauss-Markov process is
/// its stationary standard deviation.
void ReadDynamics(const Node& node, int size, OwnedRole& owned) {
  owned.dynamics = OwnedDynamics::kConstant;
  owned.sqrt_density.clear();
  constexpr const char* kKinds =
      "constant, {random_walk: SIGMA}, or {gauss_markov: {sigma: SIGMA, time_constant_s: S}}";
  if (!node.is_map()) {
    if (node.Text() != "constant") {
      node.Fail("'" + node.Text() + "' is not a kind of dynamics", kKinds);
    }
    return;
  }
  const auto walk = node.Find("random_walk"), markov = node.Find("gauss_markov");
  if (walk.has_value() == markov.has_value()) {
    node.RejectUnread();
    node.Fail("a state needs exactly one kind of dynamics", kKinds);
  }
  node.RejectUnread();
  if (walk) {
    owned.dynamics = OwnedDynamics::kRandomWalk;
    owned.sqrt_density = ReadSqrtDiagonal(*walk, size);
    return;
  }
  constexpr double kMaxSeconds = 1e9;
  owned.dynamics = OwnedDynamics::kGaussMarkov;
  owned.time_constant_s =
      markov->At("time_constant_s", "gauss_markov").Number(0.0, kMaxSeconds, true);
  owned.sqrt_density = ReadSqrtDiagonal(markov->At("sigma", "gauss_markov"), size);
  for (double& density : owned.sqrt_density) density *= std::sqrt(2.0 / owned.time_constant_s);
  markov->RejectUnread();
}

/// Reader of the states that a sensor owns. The keys of the sensor's entry describe these states:
/// the maps `initial` and `dynamics`, which have one key per role, the lists `consider` and
/// `constant`, and `time_offset_s`. The model provides the defaults.
class OwnedStateReader {
  static constexpr const char* kTimeOffset = "time_offset";

 public:
  OwnedStateReader(std::string name, const Node& entry, const Node& roles, const SensorModel& model)
      : name_(std::move(name)),
        entry_(entry),
        is_of_config_(internal::HasEquationsInConfig(model.name())),
        offset_(entry.Find("time_offset_s")) {
    std::vector<std::string> owned;
    for (const Space& role : model.roles()) {
      if ((role.flags & ALIDADE_ROLE_OWNED) != 0 && !roles.Find(role.name)) {
        owned.push_back(role.name);
      }
    }
    if (offset_) owned.emplace_back(kTimeOffset);
    if (owned.empty()) return;
    considered_ = ReadNames(entry, "consider", owned);
    constant_ = ReadNames(entry, "constant", owned);
    for (const char* key : {"initial", "dynamics"}) entry.Declare(key);
    initial_ = entry.Find("initial");
    dynamics_ = entry.Find("dynamics");
  }

  /// Reads the state of a role. `owned` contains the default values of the model.
  OwnedState Read(const Space& role, const OwnedRole& owned, const Problem& problem) {
    const auto has_name = [&](const Block& block) { return block.owner == name_; };
    if (!std::exchange(has_read_state_, true) &&
        std::ranges::any_of(problem.layout.blocks(), has_name)) {
      entry_.Fail("the sensor owns the state '" + name_ + '.' + role.name +
                      "', but a state entry has the same name as the sensor",
                  "another name for the sensor, or a block for the role under `roles`");
    }
    const bool is_offset = role.name == kTimeOffset;
    const auto initial = is_offset  ? (offset_->is_map() ? offset_ : std::nullopt)
                         : initial_ ? initial_->Find(role.name)
                                    : std::nullopt;
    const bool is_considered = Contains(considered_, role.name);
    if (is_of_config_ && !is_offset && !initial && !Contains(constant_, role.name)) {
      entry_.At("owns").At(role.name).Fail(
          "the state has no initial value",
          "initial: {" + role.name + ": " + InitialExample(role) + "}, or constant: [" + role.name +
              "], which is exactly " + (role.geometry.ambient > 1 ? "the neutral element" : "0"));
    }
    const bool is_constant =
        Contains(constant_, role.name) || (!initial && owned.sqrt_prior.empty());
    if (is_considered && is_constant) {
      entry_.At("consider")
          .Fail(
              "'" + role.name + "' cannot also be constant, because a constant has no uncertainty",
              "a sigma under `initial`, and no entry '" + role.name + "' in `constant`");
    }
    OwnedState state = OwnedState::Of(owned);
    state.initial.status = is_constant     ? BlockStatus::kConstant
                           : is_considered ? BlockStatus::kConsider
                                           : BlockStatus::kEstimated;
    if (initial) {
      if (const auto sensor = initial->Find("from_measurement")) {
        sensor->Fail("a state that a sensor owns cannot start from a measurement",
                     "mean and sigma");
      }
      state.initial = ReadInitial(*initial, role, role.name, state.initial.status);
    }
    if (is_offset) CheckOffset(state.initial);
    const auto dynamics = dynamics_ ? dynamics_->Find(role.name) : std::nullopt;
    if (dynamics) ReadDynamics(*dynamics, role.geometry.tangent, state.process);
    if (is_constant && dynamics && state.process.dynamics != OwnedDynamics::kConstant) {
      dynamics->Fail("'" + role.name +
                     "' is constant, so it cannot have dynamics; "
                     "add an initial sigma, or remove this key");
    }
    const bool is_exact =
        state.initial.covariance.isZero(0.0) &&
        std::ranges::all_of(state.initial.sigma, [](double s) { return s == 0.0; });
    const bool is_varied = is_considered || state.process.dynamics != OwnedDynamics::kConstant;
    if (is_exact && !is_varied) state.initial.status = BlockStatus::kConstant;
    return state;
  }

  /// Adds the time offset of a sensor whose roles are bound. Has no effect if the offset is missing
  /// or 0.
  void AddTimeOffset(Problem& problem, SensorBinding& sensor) {
    if (!offset_ || (!offset_->is_map() && offset_->Number() == 0.0)) return;
    OwnedRole defaults;
    defaults.mean = {offset_->is_map() ? 0.0 : offset_->Number()};
    const Space space{
        kTimeOffset, "s", "added to the timestamps of the sensor", {""}, Geometry::Vector(1)};
    const BlockId id =
        internal::AddOwnedState(problem, name_, space, Read(space, defaults, problem));
    const std::string reason = internal::OffsetInTime(problem, id, sensor);
    if (!reason.empty()) offset_->Fail(reason + "; remove this key");
  }

  void RejectUnread() const {
    if (initial_) initial_->RejectUnread();
    if (dynamics_) dynamics_->RejectUnread();
  }

 private:
  /// Rejects an offset that is too long for the prediction of a filter.
  void CheckOffset(const InitialValue& offset) const {
    constexpr double kMaxSeconds = 60.0;
    const double sigma = offset.covariance.size() == 0 ? 0.0 : std::sqrt(offset.covariance(0, 0));
    if (std::abs(offset.mean[0]) <= kMaxSeconds && sigma <= kMaxSeconds) return;
    offset_->Fail("a motion model cannot predict over such a long time offset",
                  "at most 60 s for the offset and for its sigma");
  }

  std::string name_;
  Node entry_;
  bool is_of_config_;  ///< true if the config declares the states, which then have no default
  bool has_read_state_ = false;
  std::optional<Node> offset_, initial_, dynamics_;
  std::vector<std::string> considered_, constant_;
};

/// Returns a text that lists the blocks which `role` can be bound to: those of its geometry whose
/// unit does not differ.
std::string BlocksFor(const Space& role, const Problem& problem) {
  std::vector<std::string> names;
  for (const Block& block : problem.layout.blocks()) {
    const bool is_unit_equal = block.space.unit.empty() || block.space.unit == role.unit;
    if (block.geometry() == role.geometry && is_unit_equal) names.push_back(block.name);
  }
  if (names.empty()) return "a block of `state`, in the form ENTRY.BLOCK";
  return (names.size() > 1 ? "one of " : "") + internal::Join(names);
}

/// Returns the block that `node` names. `expected` lists the accepted blocks in messages.
BlockId FindBlock(const Node& node, const Problem& problem, std::string expected = {}) {
  const std::string name = node.Text();
  const BlockId id = problem.layout.Find(name);
  if (id >= 0) return id;
  const std::vector<std::string> names = NamesOf(problem.layout.blocks());
  if (expected.empty()) expected = internal::Join(names);
  node.Fail("block '" + name + "' does not exist", expected, Nearest(name, names));
}

/// Rejects a block whose geometry or unit differs from that of the role. A unit that the model does
/// not declare is not checked.
void CheckBlock(const Node& node, const Block& block, const Space& role, const SensorModel& model) {
  const std::string of_role = " for role '" + role.name + "' of model '" + model.name() + "'";
  if (!(block.geometry() == role.geometry)) {
    node.Fail("block '" + block.name + "' has geometry " + ToString(block.geometry()),
              ToString(role.geometry) + of_role);
  }
  const std::string& unit = block.space.unit;
  if (unit.empty() || role.unit.empty() || unit == role.unit) return;
  node.Fail("block '" + block.name + "' has the unit " + unit, role.unit + of_role);
}

RoleBinding ReadRole(const Node& node, const Space& role, const SensorModel& model,
                     const Problem& problem) {
  RoleBinding binding;
  if (!node.is_map()) {
    binding.block = FindBlock(node, problem, BlocksFor(role, problem));
  } else {
    binding.block = FindBlock(node.At("block", "a role"), problem, BlocksFor(role, problem));
    if (const auto mode = node.Find("mode")) {
      binding.mode = static_cast<RoleMode>(mode->Choice({"estimate", "consider", "known"}));
    }
    if (const auto choice = node.Find("jacobian_at")) {
      binding.jacobian_at = static_cast<JacobianAt>(choice->Choice({"prediction", "measurement"}));
    }
    node.RejectUnread();
  }
  CheckBlock(node, problem.layout[binding.block], role, model);
  return binding;
}

/// Reads `{NAME: SCALE}` for one of kLosses except `none`.
RobustLoss ReadLoss(const Node& node) {
  std::optional<RobustLoss> loss;
  std::vector<std::string> loss_texts;
  int count = 0;
  for (std::size_t i = 1; i < kLosses.size(); ++i) {
    loss_texts.push_back(std::string("{") + kLosses[i].name + ": SCALE}");
    const auto scale = node.Find(kLosses[i].name);
    if (!scale) continue;
    ++count;
    loss = {static_cast<LossKind>(i),
            scale->Number(0.0, std::numeric_limits<double>::infinity(), true, true)};
  }
  node.RejectUnread();
  if (count != 1)
    node.Fail("the map must contain exactly one loss, with its scale",
              "one of " + internal::Join(loss_texts));
  return *loss;
}

/// Rejects roles whose blocks do not exist.
void ExpectBlocks(const Node& roles, const Problem& problem) {
  for (const auto& [name, node] : roles.Entries()) {
    if (name != "landmark") FindBlock(node.is_map() ? node.At("block", "a role") : node, problem);
  }
}

/// Rejects a role that the model does not have.
void RejectUnknownRoles(const Node& roles, const SensorModel& model) {
  std::vector<std::string> known;
  for (const Space& role : model.roles()) {
    known.push_back(role.landmark() ? "landmark" : role.name);
    if (role.landmark()) break;  // all remaining roles belong to the landmark
  }
  for (const auto& [name, node] : roles.Entries()) {
    if (Contains(known, name)) continue;
    node.Fail("unknown key", (known.size() > 1 ? "one of " : "") + internal::Join(known),
              Nearest(name, known));
  }
}

void ReadSensor(const std::string& name, const Node& entry, const PluginHost& host,
                Problem& problem) {
  const std::string model_name = entry.At("model", "a sensor entry").Text();
  SensorOptions options{.stream = entry.At("stream", "sensor '" + name + "'").Text()};
  const Node roles =
      entry.At("roles", "sensor '" + name + "'", "roles: ENTRY, or roles: {ROLE: ENTRY.BLOCK}");
  roles.ExpectMap("{ROLE: ENTRY.BLOCK}");
  if (internal::HasEquationsInConfig(model_name)) ExpectBlocks(roles, problem);
  const SharedSensor model =
      CreateBoundSensor(model_name, entry, BoundRoles(roles, problem.layout), host);
  if (const auto loss = entry.Find("loss")) options.loss = ReadLoss(*loss);
  RejectUnknownRoles(roles, *model);
  OwnedStateReader owned_states(name, entry, roles, *model);
  std::vector<RoleBinding> bindings;
  for (std::size_t i = 0; i < model->roles().size(); ++i) {
    const Space& role = model->roles()[i];
    if (role.landmark()) break;  // all remaining roles belong to the landmark
    const auto node = roles.Find(role.name);
    const bool is_owned = !node && (role.flags & ALIDADE_ROLE_OWNED) != 0;
    if (is_owned) options.owned.emplace(i, owned_states.Read(role, model->owned(i), problem));
    if (is_owned || (!node && role.optional())) {
      bindings.emplace_back();
      continue;
    }
    const Node role_node =
        node ? *node : roles.At(role.name, "model '" + model_name + "'", BlocksFor(role, problem));
    bindings.push_back(ReadRole(role_node, role, *model, problem));
    const BlockId block = bindings.back().block;
    if (std::ranges::count(bindings, block, &RoleBinding::block) > 1) {
      role_node.Fail("block '" + problem.layout[block].name + "' is already bound to another role",
                     "a different block for each role");
    }
  }
  if (model->has_landmark()) internal::ReadLandmarkKeys(name, entry, *model, host, options);
  AddAt(entry, [&] { problem.AddSensor(name, model, bindings, options); });
  owned_states.AddTimeOffset(problem, problem.sensors.back());
  owned_states.RejectUnread();
  entry.RejectUnread();
}

/// Returns the problem with only the named sensors, in this order, and the state entries that these
/// sensors use; without sensors, all state entries.
Problem SelectSensors(Problem problem, const std::vector<std::string>& names) {
  std::vector<SensorBinding> sensors;
  std::vector<std::string> used_entries;
  for (const std::string& name : names) {
    const int index = problem.FindSensor(name);
    if (index >= 0) sensors.push_back(problem.sensors[static_cast<std::size_t>(index)]);
  }
  for (const SensorBinding& sensor : sensors) {
    for (const RoleBinding& role : sensor.roles) {
      if (role.block >= 0) used_entries.push_back(problem.layout[role.block].owner);
    }
  }
  if (sensors.empty()) used_entries = NamesOf(problem.motions);
  Problem selected;
  selected.initial_time_s = problem.initial_time_s;
  selected.landmarks = std::move(problem.landmarks);
  std::vector<BlockId> new_ids;
  for (const Block& block : problem.layout.blocks()) {
    new_ids.push_back(
        Contains(used_entries, block.owner)
            ? selected.layout.Declare(block.name, block.owner, block.space, block.status)
            : -1);
  }
  const auto update = [&new_ids](BlockId& id) {
    if (id >= 0) id = new_ids[static_cast<std::size_t>(id)];
  };
  for (MotionBinding& motion : problem.motions) {
    if (!Contains(used_entries, motion.name)) continue;
    for (BlockId& id : motion.blocks) update(id);
    selected.motions.push_back(std::move(motion));
  }
  for (Prior& prior : problem.priors) {
    update(prior.block);
    if (prior.block >= 0) selected.priors.push_back(std::move(prior));
  }
  for (SensorBinding& sensor : sensors) {
    for (RoleBinding& role : sensor.roles) update(role.block);
  }
  selected.sensors = std::move(sensors);
  for (const StreamInfo& stream : problem.streams) {
    const auto is_stream = [&](const auto& name) { return name == stream.name; };
    const auto input = [](const MotionBinding& motion) { return motion.input.stream; };
    if (std::ranges::any_of(selected.sensors, is_stream, &SensorBinding::stream) ||
        std::ranges::any_of(selected.motions, is_stream, input)) {
      selected.streams.push_back(stream);
    }
  }
  return selected;
}

}  // namespace

std::vector<double> ReadBlockValue(const Node& node, const Space& space) {
  const Geometry& geometry = space.geometry;
  const int quaternion = geometry.row().quaternion;
  const bool is_map = quaternion >= 0 && node.kind() != Node::Kind::kList;
  std::vector<double> value =
      is_map ? ReadElements(node, geometry) : node.Numbers(geometry.ambient, space.unit);
  if (DistanceFrom(geometry, value.data()) > kUnitTolerance) {
    node.Fail("the value does not have unit length", "a length within 1e-3 of 1");
  }
  if (geometry.is_angle() && std::abs(value[0]) > 2.0 * std::numbers::pi) {
    node.Fail(internal::NumberText(value[0]) + " rad is more than a revolution",
              "a number in rad, or a number with a unit, as in 90deg");
  }
  if (quaternion >= 0) {
    internal::ChooseSign({}, std::span(value).subspan(static_cast<std::size_t>(quaternion), 4));
  }
  return value;
}

std::vector<Space> BoundRoles(const Node& roles, const StateLayout& blocks) {
  std::vector<Space> bound;
  for (const auto& [name, node] : roles.Entries()) {
    const std::optional<Node> block = node.is_map() ? node.Find("block") : node;
    const BlockId id = block ? blocks.Find(block->Text()) : -1;
    if (id < 0) continue;
    bound.push_back(blocks[id].space);
    bound.back().name = name;
  }
  return bound;
}

SharedMotion CreateStateModel(const std::string& model, const Node& entry, const PluginHost& host) {
  if (const auto* const in_config = internal::FindModelInConfig(model))
    return in_config->create_motion(entry);
  return host.CreateMotion(model, entry);
}

SharedSensor CreateBoundSensor(const std::string& model, const Node& entry,
                               std::vector<Space> bound_roles, const PluginHost& host) {
  if (const auto* const in_config = internal::FindModelInConfig(model)) {
    for (Space& role : bound_roles) role.flags = 0;
    const auto roles = entry.Find("roles");
    const bool has_landmark = roles && roles->is_map() && roles->Find("landmark");
    return in_config->create_sensor(entry, bound_roles, has_landmark);
  }
  std::map<std::string, std::string> geometries;
  for (const Space& role : bound_roles) geometries[role.name] = ToString(role.geometry);
  return host.CreateSensor(model, entry, {}, geometries);
}

Problem ReadProblem(const Node& root, const PluginHost& host,
                    const std::optional<std::vector<std::string>>& sensor_names) {
  Problem problem;
  constexpr const char* kState = "NAME: {model: constant, initial: {value: {mean: 0, sigma: 1}}}";
  const Node state = root.At("state", "a run", kState);
  state.ExpectMap(kState);
  for (const auto& [name, entry] : state.Entries()) {
    internal::ExpectName(name, entry, "a state entry");
    if (name == "landmarks") {
      entry.Fail("'landmarks' cannot name a state entry, because landmark blocks use this name",
                 "another name");
    }
    ReadStateEntry(name, entry, host, problem);
  }
  constexpr const char* kSensors =
      "NAME: {model: MODEL, stream: STREAM, roles: {ROLE: ENTRY.BLOCK}}";
  const Node sensors = root.At("sensors", "a run", kSensors);
  sensors.ExpectMap(kSensors);
  for (const auto& [name, entry] : sensors.Entries()) {
    internal::ExpectName(name, entry, "a sensor");
    ReadSensor(name, entry, host, problem);
  }
  problem.landmarks = internal::ReadLandmarks(root, problem.sensors);
  constexpr double kMaxInitialTime = 4.6e9;  // two timestamps may differ by twice this limit
  if (const auto start = root.Find("initial_time_s"))
    problem.initial_time_s = start->Number(-kMaxInitialTime, kMaxInitialTime);
  if (sensor_names) problem = SelectSensors(std::move(problem), *sensor_names);
  const auto observes_landmarks = [](const SensorBinding& sensor) {
    return sensor.model->has_landmark();
  };
  if (std::ranges::none_of(problem.sensors, observes_landmarks)) problem.landmarks.reset();
  if (const auto defect = FindDefect(problem)) {
    internal::FindDefectNode(*defect, root, problem)
        .Fail(defect->description, defect->remedy, defect->nearest);
  }
  return problem;
}

}  // namespace alidade
