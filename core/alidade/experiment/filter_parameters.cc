// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/filter_parameters.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"

namespace alidade::internal {
namespace {

using Parameters = std::vector<FilterParameter>;

/// Keys of an entry whose values are not standard deviations of a model. The standard deviation of
/// a prior affects only the first measurements.
constexpr std::array<std::string_view, 7> kOtherKeys = {
    "initial", "roles", "blocks", "input", "loss", "outlier_rejection", "time_offset_s"};

/// Returns a number or a list of numbers; nullopt if the node has another value.
std::optional<std::vector<double>> NumbersOf(const Node& node) {
  try {
    return node.Numbers();
  } catch (const Error&) {
    return std::nullopt;
  }
}

/// Adds each number of the node. Has no effect if the node has other values.
void AddNumbers(const Node& node, const std::string& key, bool is_deviation,
                Parameters& parameters) {
  const auto values = NumbersOf(node);
  if (!values) return;
  const bool is_list = node.kind() == Node::Kind::kList;
  for (std::size_t i = 0; i < values->size(); ++i) {
    parameters.push_back({key, *values, i, is_list, is_deviation});
  }
}

/// Adds the standard deviations in a map. `is_noise` is true inside the map `noise`, in which every
/// number is a standard deviation.
void AddDeviations(const Node& map, const std::string& path, bool is_noise,
                   Parameters& parameters) {
  for (const auto& [name, value] : map.Entries()) {
    if (std::ranges::find(kOtherKeys, name) != kOtherKeys.end()) continue;
    const std::string key = path + '.' + name;
    if (value.is_map()) {
      AddDeviations(value, key, is_noise || name == "noise", parameters);
    } else if (is_noise || name.starts_with("sigma") || name == "random_walk") {
      AddNumbers(value, key, true, parameters);
    }
  }
}

/// Adds the values of the blocks in the list `constant` of the entry `owner`. Omits unit vectors
/// and quaternions, whose elements are not independent.
void AddConstants(const Node& entry, const std::string& owner, const std::string& path,
                  const StateLayout& layout, Parameters& parameters) {
  const auto constant = entry.Find("constant"), initial = entry.Find("initial");
  if (!constant || !initial) return;
  for (const Node& block : constant->Items()) {
    const BlockId id = layout.Find(owner + '.' + block.Text());
    if (id >= 0 && layout[id].geometry().tangent != layout[id].geometry().ambient) continue;
    const auto value = initial->Find(block.Text());
    const auto mean = value ? value->Find("mean") : std::nullopt;
    if (mean) AddNumbers(*mean, path + ".initial." + block.Text() + ".mean", false, parameters);
  }
}

void AddTimeOffset(const Node& sensor, const std::string& path, Parameters& parameters) {
  const auto offset = sensor.Find("time_offset_s");
  if (offset && offset->is_map()) return;  // the filter estimates the offset
  parameters.push_back({path + ".time_offset_s", {offset ? offset->Number() : 0.0}});
}

}  // namespace

std::string FilterParameter::name() const {
  return is_list ? key + '[' + std::to_string(element) + ']' : key;
}

std::string FilterParameter::YamlOf(double value) const {
  std::vector<std::string> numbers;
  for (const double number : values) numbers.push_back(NumberText(number));
  numbers[element] = NumberText(value);
  return is_list ? '[' + Join(numbers) + ']' : numbers[element];
}

std::vector<FilterParameter> FilterParametersOf(const Node& root, const Problem& problem) {
  Parameters parameters;
  const auto add_entry = [&](const Node& entry, const std::string& name, const std::string& path) {
    AddDeviations(entry, path, false, parameters);
    AddConstants(entry, name, path, problem.layout, parameters);
  };
  const std::vector<std::string> states = NamesOf(problem.motions);
  for (const auto& [name, entry] : root.At("state").Entries()) {
    // The other motion models are those of the states that sensors own.
    if (std::ranges::find(states, name) != states.end()) add_entry(entry, name, "state." + name);
  }
  for (const SensorBinding& sensor : problem.sensors) {
    const Node entry = root.At("sensors").At(sensor.name);
    const std::string path = "sensors." + sensor.name;
    add_entry(entry, sensor.name, path);
    AddTimeOffset(entry, path, parameters);
  }
  return parameters;
}

}  // namespace alidade::internal
