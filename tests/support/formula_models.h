// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <utility>
#include <vector>

#include "alidade/formula/models_in_config.h"
#include "alidade/state/element_names.h"
#include "alidade/testing/jacobians.h"
#include "support/config_text.h"

/// Formula models and linear models from YAML texts. For tests.
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

inline SharedSensor LinearSensorOf(const std::string& yaml, const std::vector<Space>& roles) {
  const Config config = Read(yaml);
  SharedSensor sensor = internal::CreateLinearSensor(config.root(), roles, false);
  config.root().RejectUnread();
  return sensor;
}
inline SharedMotion LinearMotionOf(const std::string& yaml) {
  const Config config = Read(yaml);
  SharedMotion motion = internal::CreateLinearMotion(config.root());
  config.root().RejectUnread();
  return motion;
}

/// Returns Q = G L L' G' of a step, row-major.
inline std::vector<double> ProcessNoise(const SharedMotion& motion, const Blocks& x,
                                        const double* u, double dt_s) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const int n = motion->tangent_size(), n_w = motion->noise_size();
  const auto step = StepWithJacobians(motion, x, u, nullptr, dt_s);
  RowMajor l(n_w, n_w);
  EXPECT_EQ(motion->SqrtQ(Pointers(x).data(), u, dt_s, l.data()), Status::kOk);
  const RowMajor g = Eigen::Map<const RowMajor>(step.g.data(), n, n_w) * l;
  const RowMajor q = g * g.transpose();
  return {q.data(), q.data() + q.size()};
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
