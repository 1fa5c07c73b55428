// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "alidade/formula/program.h"
#include "alidade/model/plugin_abi.h"

/// Functions that an expression may call, and the operators. They act on vectors, which are lists
/// of nodes of a Program.
namespace alidade::internal {

/// Compiled expression: one node for each element. A number is a vector of size 1.
struct Value {
  std::vector<int> nodes;
  /// Geometry of a measurement that consists of this value: a vector, an angle, a unit vector or a
  /// unit quaternion.
  std::uint32_t geometry = ALIDADE_VECTOR;
  std::vector<std::string> elements = {};  ///< names of the elements; may be empty

  std::size_t size() const { return nodes.size(); }
};

/// Operands that an operator or a function rejects.
struct OperandError : std::runtime_error {
  OperandError(const std::string& problem, std::string remedy)
      : std::runtime_error(problem), expected(std::move(remedy)) {}
  std::string expected;
};

struct Function {
  const char* name;
  std::size_t arguments;  ///< number of arguments
  const char* call;       ///< `atan2(y, x)`
  const char* meaning;
  /// Adds the function to the program. Error: OperandError.
  Value (*compile)(Program& program, const std::vector<Value>& arguments);
};

/// Returns all functions, in the order of the documentation.
std::span<const Function> Functions();

/// Compiles an operator of two operands. Each operand is a number or a vector; a number applies to
/// all elements of a vector. The sum of an angle and a number is an angle. Error: OperandError.
Value CompileOperator(Program& program, Op op, const Value& a, const Value& b);
/// Returns -a.
Value CompileNegation(Program& program, const Value& a);

/// Returns half the product of the unit quaternion q and the pure quaternion of `rate`. This is the
/// derivative of q if `rate` is the angular velocity in the frame of the body.
Value CompileQuaternionRate(Program& program, const Value& q, const Value& rate);

}  // namespace alidade::internal
