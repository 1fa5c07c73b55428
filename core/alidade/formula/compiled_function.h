// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/formula/parser.h"
#include "alidade/formula/program.h"
#include "alidade/model/status.h"
#include "alidade/state/manifold.h"

namespace alidade::internal {

/// Converts a Jacobian of ambient elements to Jacobians of tangent elements, one for each input.
///
///   J_i = C A_i T_i,   C = d(y' (-) y)/dy',   T_i = d(x_i (+) d)/dd at d = 0
///
/// `ambient` contains A = (A_1, A_2, ...), row-major. An entry of `jacobians` may be null.
void ToTangent(const std::vector<Geometry>& outputs, const double* y,
               const std::vector<Geometry>& inputs, const double* const* x, const double* ambient,
               double* const* jacobians, const int* strides);

/// Function y = f(x_1, x_2, ...) of values with geometries, compiled from expressions. Const
/// members are thread-safe and do not allocate memory.
class CompiledFunction {
 public:
  /// Largest number of elements of all inputs, and of all outputs.
  static constexpr int kMaxElements = 64;

  /// `owner` is the entry that messages report if there are too many elements.
  CompiledFunction(std::vector<Geometry> inputs, const Node& owner);

  Program& program() { return program_; }
  const Program& program() const { return program_; }
  /// Returns the first variable of an input.
  int offset(std::size_t input) const { return offsets_[input]; }
  const std::vector<Geometry>& inputs() const { return inputs_; }
  /// Returns the nodes on which each element of the outputs depends.
  const std::vector<Program::Sweep>& sweeps() const { return sweeps_; }

  /// Appends an output. `owner` is the expression that messages report.
  void AddOutput(const Geometry& geometry, const Value& value, const Node& owner);
  /// Restricts the domain of the function.
  void AddConditions(const std::vector<Condition>& conditions);

  /// Computes y and its Jacobians, one for each input. `jacobians` and each of its entries may be
  /// null. Returns kOutOfDomain if y is not defined; the outputs are then unchanged.
  Status Evaluate(const double* const* x, double* y, double* const* jacobians = nullptr,
                  const int* strides = nullptr) const;
  /// Computes the ambient elements of y, and their Jacobian with respect to the concatenated
  /// inputs, row-major. `jacobian` may be null. Returns false if y is not defined.
  bool EvaluateAmbient(const double* x, double* y, double* jacobian) const;

 private:
  std::vector<Geometry> inputs_, outputs_;
  std::vector<int> offsets_;
  Program program_;
  std::vector<Program::Sweep> sweeps_;  ///< one for each element of the outputs
  std::vector<double> constants_;       ///< elements of vectors that do not depend on the inputs
  std::vector<Condition> conditions_;
};

}  // namespace alidade::internal
