// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/formula/functions.h"
#include "alidade/formula/scope.h"

/// Parser of the expressions in a config. The grammar is
///
///   sum       = product {("+" | "-") product}
///   product   = unary {("*" | "/") unary}
///   unary     = {"+" | "-"} power
///   power     = postfix ["^" unary]
///   postfix   = primary {"." NAME | "[" INTEGER "]"}
///   primary   = NUMBER[UNIT] | NAME | FUNCTION "(" sum {"," sum} ")" | "(" sum ")"
///             | "[" sum {"," sum} "]"
///   condition = sum RELATION sum {RELATION sum} {"and" condition}
///   RELATION  = "<" | "<=" | ">" | ">="
///
/// so that -x^2 is -(x^2) and x^y^z is x^(y^z). Every failure is an Error kBadConfig with the line
/// and column of the defect inside the expression.
namespace alidade::internal {

inline constexpr std::string_view kPi = "pi";
inline constexpr std::string_view kAnd = "and";

/// Condition that a node is > 0, or >= 0.
struct Condition {
  int node = 0;
  bool accepts_zero = false;
};

/// Returns whether `name` consists of letters, digits and `_`, and does not begin with a digit.
bool IsIdentifier(std::string_view name);

/// Compiles an expression. A list of expressions is a vector.
Value ParseExpression(const Node& node, Scope& scope);
/// Compiles an expression that must have `size` elements. `subject` has these elements in messages.
Value ParseExpression(const Node& node, Scope& scope, int size, const std::string& subject);
/// Compiles a condition, or a list of conditions that must all be true.
std::vector<Condition> ParseConditions(const Node& node, Scope& scope);

}  // namespace alidade::internal
