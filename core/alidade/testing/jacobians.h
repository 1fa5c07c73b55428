// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "alidade/base/error.h"
#include "alidade/estimation/models.h"

/// Helper functions for tests of models. They return the Jacobians that a model computes, and
/// numeric Jacobians.
namespace alidade::testing {

/// Ambient values of roles or blocks: one vector for each role or block.
using Blocks = std::vector<std::vector<double>>;

/// Returns the sum of the tangent sizes of the spaces.
inline int TangentSize(const std::vector<Space>& spaces) {
  int size = 0;
  for (const Space& space : spaces) size += space.geometry.tangent;
  return size;
}

/// Returns pointers to the blocks, as models expect them. The pointer to an empty block is null.
inline std::vector<const double*> Pointers(const Blocks& blocks) {
  std::vector<const double*> pointers;
  for (const auto& block : blocks) pointers.push_back(block.empty() ? nullptr : block.data());
  return pointers;
}
inline std::vector<double*> Pointers(Blocks& blocks) {
  std::vector<double*> pointers;
  for (auto& block : blocks) pointers.push_back(block.data());
  return pointers;
}

/// Returns blocks with all elements equal to `value`.
inline Blocks Filled(const std::vector<Space>& spaces, double value) {
  Blocks blocks;
  for (const Space& space : spaces) {
    blocks.emplace_back(static_cast<std::size_t>(space.geometry.ambient), value);
  }
  return blocks;
}

/// Returns d f / d x, row-major, in the tangent spaces of x and f(x). `inputs` are the spaces of x.
/// `outputs` are the spaces of f(x). The Jacobian is computed by central differences D(h) and one
/// Richardson step, (4 D(h/2) - D(h)) / 3. The error is of order h^4 f'''''.
template <class F>
std::vector<double> NumericJacobian(const std::vector<Space>& inputs, const Blocks& x,
                                    const std::vector<Space>& outputs, const F& f,
                                    double h = 1e-3) {
  const int rows = TangentSize(outputs), columns = TangentSize(inputs);
  std::vector<double> j(static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns));
  const Blocks center = f(x);
  const auto add = [&](std::size_t block, int k, double step, int column, double weight) {
    Blocks moved = x;
    std::vector<double> d(static_cast<std::size_t>(inputs[block].geometry.tangent));
    d[static_cast<std::size_t>(k)] = step;
    inputs[block].geometry.Plus(x[block].data(), d.data(), moved[block].data());
    const Blocks y = f(moved);
    int row = 0;
    for (std::size_t i = 0; i < outputs.size(); ++i) {
      std::vector<double> difference(static_cast<std::size_t>(outputs[i].geometry.tangent));
      outputs[i].geometry.Minus(y[i].data(), center[i].data(), difference.data());
      for (const double element : difference) {
        j[static_cast<std::size_t>(row++ * columns + column)] += weight * element;
      }
    }
  };
  int column = 0;
  for (std::size_t block = 0; block < inputs.size(); ++block) {
    for (int k = 0; k < inputs[block].geometry.tangent; ++k, ++column) {
      for (const double sign : {1.0, -1.0}) {
        add(block, k, sign * h / 2, column, sign * 4.0 / (3.0 * h));
        add(block, k, sign * h, column, -sign / (6.0 * h));
      }
    }
  }
  return j;
}

/// Returns memory for an output. All elements are NaN, so that a test detects elements that a model
/// does not write.
inline std::vector<double> UnwrittenOutput(int size) {
  return std::vector<double>(static_cast<std::size_t>(size),
                             std::numeric_limits<double>::quiet_NaN());
}

/// Returns the Jacobian of h that the model computes: m x n, row-major, with the columns of all
/// roles side by side. ContractViolation if h is not defined at the roles.
inline std::vector<double> SensorJacobian(const SharedSensor& sensor, const Blocks& roles,
                                          const double* known = nullptr) {
  const int m = sensor->measurement().geometry.tangent, n = TangentSize(sensor->roles());
  std::vector<double> z = UnwrittenOutput(sensor->measurement().geometry.ambient),
                      j = UnwrittenOutput(m * n);
  std::vector<double*> blocks;
  int column = 0;
  for (const Space& role : sensor->roles()) {
    blocks.push_back(j.data() + column);
    column += role.geometry.tangent;
  }
  const std::vector<int> strides(blocks.size(), n);
  const Status status =
      sensor->Linearise(Pointers(roles).data(), z.data(), blocks.data(), strides.data(), known);
  ALIDADE_EXPECTS(status == Status::kOk);
  return j;
}

/// Returns the Jacobian of h, computed by numeric differentiation. ContractViolation if h is not
/// defined at all points within 1e-3 of the roles.
inline std::vector<double> NumericSensorJacobian(const SharedSensor& sensor, const Blocks& roles,
                                                 const double* known = nullptr) {
  const auto predict = [&](const Blocks& x) {
    Blocks z{UnwrittenOutput(sensor->measurement().geometry.ambient)};
    const Status status = sensor->Predict(Pointers(x).data(), z[0].data(), known);
    ALIDADE_EXPECTS(status == Status::kOk);
    return z;
  };
  return NumericJacobian(sensor->roles(), roles, {sensor->measurement()}, predict);
}

/// Result of a step of a motion model.
struct StepResult {
  Blocks next;
  std::vector<double> f;  ///< d next / d x, n x n row-major
  std::vector<double> g;  ///< d next / d w, n x n_w row-major
};

/// Returns x' and the Jacobians that the model computes for a step from x. u is the control input,
/// or null if the model has no control input. A null pointer w means that w is 0. ContractViolation
/// if the step is not defined.
inline StepResult StepWithJacobians(const SharedMotion& motion, const Blocks& x, const double* u,
                                    const double* w, double dt_s) {
  const int n = motion->tangent_size();
  StepResult result{Filled(motion->blocks(), std::numeric_limits<double>::quiet_NaN()),
                    UnwrittenOutput(n * n), UnwrittenOutput(n * motion->noise_size())};
  const Status status =
      motion->Step(Pointers(x).data(), u, w, dt_s,
                   {Pointers(result.next).data(), result.f.data(), result.g.data()});
  ALIDADE_EXPECTS(status == Status::kOk);
  return result;
}

/// Returns the same result as StepWithJacobians, but computes the Jacobians by numeric
/// differentiation. ContractViolation if the step is not defined at all points within 1e-3 of x and
/// w.
inline StepResult NumericStep(const SharedMotion& motion, const Blocks& x, const double* u,
                              const double* w, double dt_s) {
  Space noise;
  noise.geometry = Geometry::Vector(motion->noise_size());
  Blocks noises = Filled({noise}, 0.0);
  if (w != nullptr) noises[0].assign(w, w + motion->noise_size());
  const auto step = [&](const Blocks& blocks, const Blocks& drawn) {
    Blocks next = Filled(motion->blocks(), std::numeric_limits<double>::quiet_NaN());
    const Status status = motion->Step(Pointers(blocks).data(), u, drawn[0].data(), dt_s,
                                       {Pointers(next).data(), nullptr, nullptr});
    ALIDADE_EXPECTS(status == Status::kOk);
    return next;
  };
  const std::vector<Space>& spaces = motion->blocks();
  return {step(x, noises),
          NumericJacobian(spaces, x, spaces,
                          [&](const Blocks& blocks) { return step(blocks, noises); }),
          NumericJacobian({noise}, noises, spaces,
                          [&](const Blocks& drawn) { return step(x, drawn); })};
}

/// Returns max |a_i - b_i| / (1 + |b_i|), or infinity if the sizes differ or an element is NaN.
inline double LargestDifference(const std::vector<double>& a, const std::vector<double>& b) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (a.size() != b.size()) return kInfinity;
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double difference = std::abs(a[i] - b[i]) / (1.0 + std::abs(b[i]));
    largest = std::max(largest, std::isnan(difference) ? kInfinity : difference);
  }
  return largest;
}

}  // namespace alidade::testing
