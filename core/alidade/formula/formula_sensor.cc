// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "alidade/base/text.h"
#include "alidade/formula/model_keys.h"
#include "alidade/formula/models_in_config.h"
#include "alidade/state/element_names.h"

namespace alidade::internal {
namespace {

constexpr const char* kMeasured = "z";
constexpr const char* kExampleZ = "z: {range: norm(p - anchor)}";

/// Name of the role of a landmark, which is that of the representation xyz (model/landmark.h).
constexpr const char* kLandmark = "landmark";

/// Compiled functions of a sensor, and its description.
struct SensorParts {
  SensorModel::Description description;
  CompiledFunction prediction;               ///< h(roles, known)
  std::optional<CompiledFunction> sigma;     ///< standard deviations (roles, known)
  std::optional<CompiledFunction> validity;  ///< conditions (z, known)
  std::optional<CompiledFunction> inverse;   ///< g(other roles, z, known)
};

class FormulaSensor final : public SensorModel {
 public:
  explicit FormulaSensor(SensorParts parts)
      : SensorModel(std::move(parts.description)),
        prediction_(std::move(parts.prediction)),
        sigma_(std::move(parts.sigma)),
        validity_(std::move(parts.validity)),
        inverse_(std::move(parts.inverse)) {}

 private:
  /// Largest number of inputs of a function: roles, parts of z, and the known numbers.
  static constexpr std::size_t kMaxInputs = kMaxRoles + CompiledFunction::kMaxElements + 1;
  using Inputs = std::array<const double*, kMaxInputs>;
  using Matrices = std::array<double*, kMaxInputs>;
  using Strides = std::array<int, kMaxInputs>;

  Status DoEvaluate(const Observation& observation, const double* const* role_values,
                    const Output& out) const override {
    const std::size_t count = roles().size();
    Inputs inputs;
    std::copy_n(role_values, count, inputs.begin());
    inputs[count] = observation.known;
    if (out.h != nullptr) {
      Matrices jacobians;
      Strides strides;
      jacobians[count] = nullptr;
      if (out.jacobians != nullptr) {
        std::copy_n(out.jacobians, count, jacobians.begin());
        std::copy_n(out.strides, count, strides.begin());
      }
      const Status status = prediction_.Evaluate(
          inputs.data(), out.h, out.jacobians == nullptr ? nullptr : jacobians.data(),
          strides.data());
      if (status != Status::kOk) return status;
    }
    return out.sqrt_noise == nullptr ? Status::kOk : EvaluateNoise(inputs, out.sqrt_noise);
  }

  Status EvaluateNoise(const Inputs& inputs, double* sqrt_noise) const {
    double sigma[CompiledFunction::kMaxElements];
    if (sigma_->Evaluate(inputs.data(), sigma) != Status::kOk) return Status::kOutOfDomain;
    const int m = measurement().geometry.tangent;
    if (!std::all_of(sigma, sigma + m, [](double value) { return value > 0.0; }))
      return Status::kOutOfDomain;
    std::fill_n(sqrt_noise, m * m, 0.0);
    for (int i = 0; i < m; ++i) sqrt_noise[i * m + i] = sigma[i];
    return Status::kOk;
  }

  Status DoValid(const Observation& observation) const override {
    const std::array inputs = {observation.z, observation.known};
    double unused = 0.0;
    return validity_->Evaluate(inputs.data(), &unused) == Status::kOk ? Status::kOk
                                                                      : Status::kInvalid;
  }

  Status DoInitialise(const double* const* role_values, const Observation& observation,
                      const double* /*prior*/, const InverseOutput& out) const override {
    Inputs inputs{};
    Matrices jacobians{};
    Strides strides{};
    std::size_t k = 0;
    for (std::size_t i = 0; i < roles().size(); ++i) {
      if (static_cast<int>(i) == inverse().role) continue;
      inputs[k] = role_values[i];
      if (out.jx != nullptr) jacobians[k] = out.jx[i];
      strides[k++] = out.strides[i];
    }
    measurement().geometry.ForEachPart([&](const Geometry&, int ambient, int tangent) {
      inputs[k] = observation.z + ambient;
      if (out.jz != nullptr) jacobians[k] = out.jz + tangent;
      strides[k++] = measurement().geometry.tangent;
    });
    inputs[k] = observation.known;
    const bool has_jacobians =
        std::any_of(jacobians.begin(), jacobians.begin() + static_cast<std::ptrdiff_t>(k),
                    [](const double* jacobian) { return jacobian != nullptr; });
    return inverse_->Evaluate(inputs.data(), out.y, has_jacobians ? jacobians.data() : nullptr,
                              strides.data());
  }

  CompiledFunction prediction_;
  std::optional<CompiledFunction> sigma_, validity_, inverse_;
};

/// Reader of the config entry of a sensor.
class SensorReader {
 public:
  SensorReader(const Node& entry, const std::vector<Space>& bound_roles, bool has_landmark)
      : sensor_(entry, bound_roles),
        known_(keys_.ReadSpaces("known")),
        known_space_(Concatenated(known_, "known")) {
    if (has_landmark || entry_.Find(kLandmark)) roles_.push_back(ReadLandmark());
  }

  SharedSensor Read() {
    SensorParts parts{{}, ReadPrediction(), {}, {}, {}};
    SensorModel::Description& description = parts.description;
    description.name = kFormula;
    description.roles = roles_;
    description.known = known_space_;
    description.measurement = sensor_.Measurement();
    if (const auto root = sensor_.ReadSqrtCovariance()) {
      description.sqrt_noise = *root;
    } else {
      parts.sigma = ReadSigma();
    }
    parts.validity = ReadValidity();
    description.has_validity = parts.validity.has_value();
    parts.inverse = ReadInverse(description.inverse);
    CheckDefinitions();
    keys_.RejectUnread();
    return std::make_shared<FormulaSensor>(std::move(parts));
  }

 private:
  Space ReadLandmark() const {
    const auto node = entry_.Find(kLandmark);
    Space role;
    if (node) {
      role = keys_.ReadSpace(kLandmark, *node);
    } else {
      role.name = kLandmark;
      role.geometry = Geometry::Vector(3);
      role.elements = {"x", "y", "z"};
      role.unit = keys_.UnitOf(kLandmark, role.geometry);
    }
    if (role.unit.empty()) role.unit = "m";
    role.flags = ALIDADE_ROLE_LANDMARK;
    return role;
  }

  /// Declares the given spaces and the known numbers, the constants and the definitions. The
  /// elements of `spaces` are the first variables of the program.
  void Declare(const std::vector<Space>& spaces, int known_offset, Scope& scope) const {
    keys_.DeclareSpaces(spaces, 0, scope);
    keys_.DeclareSpaces(known_, known_offset, scope);
    keys_.AddTo(scope);
  }
  /// Declares `z`, whose elements are the parts of the measurement. Precedes the other names, so
  /// that an error reports the role that has this name.
  void DeclareMeasurement(int first, Scope& scope) const {
    Symbol symbol;
    for (const Space& part : parts_) {
      Value value = VariableOf(part, first);
      first += part.geometry.ambient;
      symbol.value.nodes.insert(symbol.value.nodes.end(), value.nodes.begin(), value.nodes.end());
      symbol.parts.emplace_back(part.name, std::move(value));
    }
    scope.Declare(kMeasured, std::move(symbol), entry_);
  }
  /// Appends the geometry of the known numbers, if there are any.
  std::vector<Geometry> WithKnown(std::vector<Geometry> geometries) const {
    if (!known_.empty()) geometries.push_back(known_space_.geometry);
    return geometries;
  }

  CompiledFunction ReadPrediction() {
    CompiledFunction prediction(WithKnown(GeometriesOf(roles_)), entry_);
    Scope scope(prediction.program());
    Declare(roles_, KnownOffset(prediction), scope);
    for (const auto& [name, node] : sensor_.Measured(kExampleZ).Entries()) {
      if (!IsIdentifier(name)) {
        node.Fail("'" + name + "' cannot name a part of the measurement",
                  "a name of letters, digits and _");
      }
      const Value value = ParseExpression(node, scope);
      Space space;
      space.name = name;
      space.geometry = value.geometry == ALIDADE_VECTOR
                           ? Geometry::Vector(static_cast<int>(value.size()))
                           : Geometry(value.geometry);
      space.unit = keys_.UnitOf(name, space.geometry);
      space.elements = value.elements.empty() ? ElementsOf("", space.geometry) : value.elements;
      space.doc = name + " = " + ExpressionText(node);
      if (!space.unit.empty()) space.doc += " [" + space.unit + ']';
      prediction.AddOutput(space.geometry, value, node);
      parts_.push_back(std::move(space));
    }
    if (const auto domain = entry_.Find("domain")) {
      prediction.AddConditions(ParseConditions(*domain, scope));
    }
    return prediction;
  }

  CompiledFunction ReadSigma() const {
    CompiledFunction function(WithKnown(GeometriesOf(roles_)), entry_);
    Scope scope(function.program());
    Declare(roles_, KnownOffset(function), scope);
    for (const Value& sigma : sensor_.ReadSigmas(scope)) {
      function.AddOutput(Geometry::Vector(static_cast<int>(sigma.size())), sigma,
                         entry_.At("sigma"));
    }
    return function;
  }

  std::optional<CompiledFunction> ReadValidity() const {
    const auto node = entry_.Find("valid");
    if (!node) return std::nullopt;
    CompiledFunction function(WithKnown({sensor_.Measurement().geometry}), *node);
    Scope scope(function.program());
    DeclareMeasurement(0, scope);
    Declare({}, KnownOffset(function), scope);
    function.AddConditions(ParseConditions(*node, scope));
    return function;
  }

  std::optional<CompiledFunction> ReadInverse(InverseModel& inverse) const {
    const auto map = entry_.Find("initialise");
    if (!map) return std::nullopt;
    const auto entries = map->Entries();
    const auto names_role = [&](const Space& role) {
      return entries.size() == 1 && role.name == entries[0].first;
    };
    const auto target = std::ranges::find_if(roles_, names_role);
    if (target == roles_.end()) {
      map->Fail("an inverse measurement model determines one role",
                "{ROLE: EXPRESSION} with one of " + Join(NamesOf(roles_)));
    }
    inverse = {static_cast<int>(target - roles_.begin()), 1, 0};
    std::vector<Space> other_roles = roles_;
    other_roles.erase(other_roles.begin() + inverse.role);
    std::vector<Geometry> geometries = GeometriesOf(other_roles);
    for (const Space& part : parts_) geometries.push_back(part.geometry);
    CompiledFunction function(WithKnown(std::move(geometries)), *map);
    Scope scope(function.program());
    DeclareMeasurement(function.offset(other_roles.size()), scope);
    Declare(other_roles, KnownOffset(function), scope);
    const Node& node = entries[0].second;
    function.AddOutput(
        target->geometry,
        ParseExpression(node, scope, target->geometry.ambient, "role " + target->name), node);
    return function;
  }

  /// Compiles all definitions with all names that an expression of the sensor may use.
  void CheckDefinitions() const {
    int measured = 0;
    for (const Space& role : roles_) measured += role.geometry.ambient;
    const int known = measured + sensor_.Measurement().geometry.ambient;
    Program program(known + known_space_.geometry.ambient);
    Scope scope(program);
    DeclareMeasurement(measured, scope);
    Declare(roles_, known, scope);
    keys_.CheckDefinitions(scope);
  }

  /// Returns the first variable of the known numbers, which are the last input.
  static int KnownOffset(const CompiledFunction& function) {
    return function.inputs().empty() ? 0 : function.offset(function.inputs().size() - 1);
  }

  SensorKeys sensor_;
  const Node& entry_ = sensor_.entry;
  const FormulaKeys& keys_ = sensor_.keys;
  std::vector<Space>& roles_ = sensor_.roles;
  std::vector<Space>& parts_ = sensor_.parts;
  std::vector<Space> known_;
  Space known_space_;
};

}  // namespace

SharedSensor CreateFormulaSensor(const Node& entry, const std::vector<Space>& bound_roles,
                                 bool has_landmark) {
  return SensorReader(entry, bound_roles, has_landmark).Read();
}

}  // namespace alidade::internal
