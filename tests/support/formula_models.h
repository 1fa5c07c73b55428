// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "alidade/formula/formula_motion.h"
#include "alidade/formula/formula_sensor.h"
#include "alidade/state/element_names.h"
#include "support/config_text.h"

/// Formula models from YAML texts. For tests.
namespace alidade::testing {

inline Space NamedSpace(const std::string& name, const Geometry& geometry,
                        const std::string& elements = {}) {
  Space space;
  space.name = name;
  space.geometry = geometry;
  space.elements = internal::ElementsOf(elements, geometry);
  return space;
}
/// Returns a vector with the elements x, y and z, or the first two of them.
inline Space VectorSpace(const std::string& name, int size) {
  return NamedSpace(name, Geometry::Vector(size), size == 2 ? "x,y" : size == 3 ? "x,y,z" : "");
}

/// Creates the sensor of a config entry, and rejects keys that it does not read. Roles are bound
/// to blocks with the given spaces.
inline SharedSensor FormulaSensorOf(const std::string& yaml, const std::vector<Space>& roles,
                                    bool has_landmark = false) {
  const Config config = Read(yaml);
  SharedSensor sensor = internal::CreateFormulaSensor(config.root(), roles, has_landmark);
  config.root().RejectUnread();
  return sensor;
}

inline SharedMotion FormulaMotionOf(const std::string& yaml) {
  const Config config = Read(yaml);
  SharedMotion motion = internal::CreateFormulaMotion(config.root());
  config.root().RejectUnread();
  return motion;
}

/// Returns h at the given roles.
inline std::vector<double> PredictionOf(const SharedSensor& sensor,
                                        const std::vector<std::vector<double>>& roles,
                                        const double* known = nullptr) {
  std::vector<const double*> pointers;
  for (const auto& role : roles) pointers.push_back(role.data());
  std::vector<double> h(static_cast<std::size_t>(sensor->measurement().geometry.ambient));
  EXPECT_EQ(sensor->Predict(pointers.data(), h.data(), known), Status::kOk);
  return h;
}

}  // namespace alidade::testing
