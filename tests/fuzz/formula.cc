// SPDX-License-Identifier: Apache-2.0
//
// The input is the config entry of a formula: a motion model if it has the key `blocks`, else a
// sensor with the roles p, q and a. The model is evaluated with and without derivatives.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/formula/models_in_config.h"
#include "alidade/state/element_names.h"
#include "fuzz.h"

namespace alidade::fuzz {
namespace {

constexpr std::size_t kMost = 64;  // elements of the inputs of a formula
using Numbers = std::vector<double>;

Space Role(const char* name, const Geometry& geometry, const char* elements) {
  Space space;
  space.name = name;
  space.geometry = geometry;
  space.elements = internal::ElementsOf(elements, geometry);
  return space;
}

bool AllFinite(const Numbers& values) {
  return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
}

void CheckSensor(const SensorModel& sensor) {
  std::vector<Numbers> values, jacobians;
  std::vector<const double*> roles;
  std::vector<double*> matrices;
  std::vector<int> strides;
  const auto m = static_cast<std::size_t>(sensor.measurement().geometry.tangent);
  for (const Space& role : sensor.roles()) {
    Numbers value = role.geometry.Identity();
    value[0] += role.geometry.is_vector() ? 0.7 : 0.0;
    values.push_back(value);
    jacobians.emplace_back(m * static_cast<std::size_t>(role.geometry.tangent));
    strides.push_back(role.geometry.tangent);
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    roles.push_back(values[i].data());
    matrices.push_back(jacobians[i].data());
  }
  const std::array<double, kMost> known{1.5, -0.5};
  Numbers h(static_cast<std::size_t>(sensor.measurement().geometry.ambient)), again = h, l(m * m);
  const Observation observation{nullptr, known.data()};
  const Status status = sensor.Evaluate(observation, roles.data(), {.h = h.data()});
  const Status same = sensor.Evaluate(observation, roles.data(),
                                      {again.data(), matrices.data(), strides.data(), nullptr});
  // The derivative of a function that is defined may overflow.
  Require(same == status || same == Status::kOutOfDomain, "derivatives change the status");
  if (same == Status::kOk) Require(h == again, "derivatives change the value");
  if (status == Status::kOk) Require(AllFinite(h), "the value is not finite");
  if (sensor.SqrtNoise(roles.data(), nullptr, l.data(), known.data()) == Status::kOk)
    Require(AllFinite(l), "the noise is not finite");
}

void CheckMotion(const MotionModel& motion) {
  std::vector<Numbers> values, results;
  std::vector<const double*> blocks;
  std::vector<double*> next;
  for (const Space& block : motion.blocks()) {
    values.push_back(block.geometry.Identity());
    results.push_back(values.back());
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    blocks.push_back(values[i].data());
    next.push_back(results[i].data());
  }
  const auto n = static_cast<std::size_t>(motion.tangent_size()),
             n_w = static_cast<std::size_t>(motion.noise_size());
  const std::array<double, kMost> input{0.3, 0.1};
  Numbers f(n * n), g(n * n_w), l(n_w * n_w);
  const Status status = motion.Step(blocks.data(), input.data(), nullptr, 0.1,
                                    {next.data(), nullptr, nullptr, nullptr});
  for (const Numbers& result : results)
    Require(status != Status::kOk || AllFinite(result), "the next state is not finite");
  const Status same =
      motion.Step(blocks.data(), input.data(), nullptr, 0.1, {next.data(), f.data(), g.data()});
  Require(same == status || same == Status::kOutOfDomain, "derivatives change the status");
  static_cast<void>(motion.SqrtQ(blocks.data(), input.data(), 0.1, l.data()));
}

}  // namespace
}  // namespace alidade::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  using namespace alidade::fuzz;
  const std::string text(TextOf(data, size));
  static_cast<void>(Accepts([&] {
    const Config config = Config::FromText(text, "formula");
    if (config.root().Find("blocks")) {
      CheckMotion(*internal::CreateFormulaMotion(config.root()));
    } else {
      CheckSensor(*internal::CreateFormulaSensor(
          config.root(),
          {Role("p", Geometry::Vector(3), "x,y,z"), Role("q", Geometry::UnitQuaternion(), ""),
           Role("a", Geometry::Angle(), "")},
          false));
    }
  }));
  return 0;
}
