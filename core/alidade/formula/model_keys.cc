// SPDX-License-Identifier: Apache-2.0
#include "alidade/formula/model_keys.h"

#include "alidade/config/read_covariance.h"
#include "alidade/estimation/models.h"

namespace alidade::internal {

MotionKeys::MotionKeys(const Node& model_entry, const char* forms)
    : entry(model_entry),
      keys(entry, {"noise", "inputs", "blocks"}),
      blocks(keys.ReadSpaces("blocks")),
      inputs(keys.ReadSpaces("inputs")),
      input(Concatenated(inputs, "input")),
      equation(entry) {
  const Node node = entry.At("blocks", "a motion model", "blocks: {p: [x, y], v: [x, y]}");
  if (blocks.empty() || blocks.size() > std::size_t{kMaxRoles}) {
    node.Fail("the model has " + std::to_string(blocks.size()) + " blocks",
              "1 to " + std::to_string(kMaxRoles));
  }
  const auto step = entry.Find("step"), rate = entry.Find("rate");
  if (step.has_value() == rate.has_value()) {
    rate.value_or(entry).Fail("a motion model needs exactly one of `step` and `rate`", forms);
  }
  is_rate = rate.has_value();
  equation = is_rate ? *rate : *step;
}

SensorKeys::SensorKeys(const Node& sensor_entry, const std::vector<Space>& bound_roles)
    : entry(sensor_entry), keys(entry, {"known", "owns", "roles"}), roles(bound_roles) {
  for (Space& role : keys.ReadSpaces("owns", ALIDADE_ROLE_OWNED)) roles.push_back(std::move(role));
  if (roles.size() <= std::size_t{kMaxRoles}) return;
  entry.Fail("the sensor has " + std::to_string(roles.size()) + " roles",
             "at most " + std::to_string(kMaxRoles));
}

Node SensorKeys::Measured(const char* example) const {
  const Node z = entry.At("z", "a sensor", example);
  z.ExpectMap(example);
  if (z.Entries().empty()) z.Fail("the sensor measures nothing", example);
  return z;
}

Space SensorKeys::Measurement() const {
  if (parts.size() == 1) return parts[0];
  Space all;
  all.name = "z";
  all.elements = ColumnsOf(parts);
  std::vector<Geometry> geometries;
  for (const Space& part : parts) {
    all.parts.push_back(part.name);
    all.part_units.push_back(part.unit);
    geometries.push_back(part.geometry);
    all.doc += (all.doc.empty() ? "" : "; ") + part.doc;
  }
  all.geometry = Geometry::Product(geometries);
  return all;
}

std::optional<std::vector<double>> SensorKeys::ReadSqrtCovariance() const {
  const auto covariance = entry.Find("covariance");
  if (!covariance) return std::nullopt;
  if (entry.Find("sigma"))
    covariance->Fail("the noise is also defined by `sigma`", "one of the two keys");
  return ReadSqrtR(*covariance, Measurement().geometry.tangent);
}

std::vector<Value> SensorKeys::ReadSigmas(Scope& scope) const {
  const std::string example = "sigma: {" + parts[0].name + ": 0.1}";
  const Node map = entry.At("sigma", "a sensor", example);
  map.ExpectMap(example);
  std::vector<Value> sigmas;
  for (const Space& part : parts) {
    const Node node = map.At(part.name, "z." + part.name, example);
    Value value = ParseExpression(node, scope);
    RepeatTo(part.geometry.tangent, node, value.nodes);
    for (const int element : value.nodes) {
      const auto number = scope.program().ConstantValue(element);
      if (number && !(*number > 0.0)) node.Fail("the standard deviation is not > 0");
    }
    sigmas.push_back(std::move(value));
  }
  map.RejectUnread();
  return sigmas;
}

}  // namespace alidade::internal
