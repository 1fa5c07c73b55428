// SPDX-License-Identifier: Apache-2.0
#include "alidade/formula/functions.h"

#include <algorithm>
#include <array>
#include <utility>

namespace alidade::internal {
namespace {

using Arguments = std::vector<Value>;

constexpr std::size_t kQuaternionSize = 4;

/// Rejects an argument that does not have the given size.
void ExpectSize(const Value& value, std::size_t size, const char* needed) {
  if (value.size() == size) return;
  throw OperandError("an argument has " + std::to_string(value.size()) +
                         (value.size() == 1 ? " element" : " elements"),
                     needed);
}

/// Operations on three nodes or more.
class Algebra {
 public:
  explicit Algebra(Program& program) : p_(program) {}

  int Sum(int a, int b) { return p_.Add(Op::kAdd, a, b); }
  int Difference(int a, int b) { return p_.Add(Op::kSubtract, a, b); }
  int Product(int a, int b) { return p_.Add(Op::kMultiply, a, b); }
  int Scaled(double factor, int a) { return Product(p_.Constant(factor), a); }

  int Dot(const std::vector<int>& a, const std::vector<int>& b) {
    int sum = Product(a[0], b[0]);
    for (std::size_t i = 1; i < a.size(); ++i) sum = Sum(sum, Product(a[i], b[i]));
    return sum;
  }
  int Norm(const std::vector<int>& a) {
    if (a.size() == 2) return p_.Add(Op::kHypot, a[0], a[1]);
    return p_.Add(Op::kSqrt, Dot(a, a));
  }
  std::vector<int> Cross(const std::vector<int>& a, const std::vector<int>& b) {
    std::vector<int> c;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
      c.push_back(Difference(Product(a[i], b[j]), Product(a[j], b[i])));
    }
    return c;
  }
  /// Returns v + s w t + u x t with t = 2 u x v, for q = (w, u). The sign s is 1 for the rotation
  /// R(q) v, and -1 for R(q)' v.
  std::vector<int> Rotate(const std::vector<int>& q, const std::vector<int>& v, bool is_inverse) {
    const std::vector<int> u(q.begin() + 1, q.end());
    std::vector<int> t = Cross(u, v);
    for (int& node : t) node = Scaled(2.0, node);
    const std::vector<int> last = Cross(u, t);
    std::vector<int> rotated;
    for (std::size_t i = 0; i < 3; ++i) {
      const int turned = Product(q[0], t[i]);
      rotated.push_back(Sum(is_inverse ? Difference(v[i], turned) : Sum(v[i], turned), last[i]));
    }
    return rotated;
  }
  /// Returns the product of two quaternions, w x y z.
  std::vector<int> Multiply(const std::vector<int>& a, const std::vector<int>& b) {
    const std::vector<int> u(a.begin() + 1, a.end()), v(b.begin() + 1, b.end());
    const std::vector<int> cross = Cross(u, v);
    std::vector<int> c = {Difference(Product(a[0], b[0]), Dot(u, v))};
    for (std::size_t i = 0; i < 3; ++i) {
      c.push_back(Sum(Sum(Product(a[0], v[i]), Product(b[0], u[i])), cross[i]));
    }
    return c;
  }

 private:
  Program& p_;
};

template <Op kOp>
Value EachElement(Program& program, const Arguments& arguments) {
  Value value{{}, kOp == Op::kWrap ? ALIDADE_ANGLE : ALIDADE_VECTOR};
  for (const int node : arguments[0].nodes) value.nodes.push_back(program.Add(kOp, node));
  if (kOp == Op::kWrap) ExpectSize(value, 1, "one number");
  return value;
}

template <Op kOp>
Value EachPair(Program& program, const Arguments& arguments) {
  Value value = CompileOperator(program, kOp, arguments[0], arguments[1]);
  if (kOp == Op::kAtan2 && value.size() == 1) value.geometry = ALIDADE_ANGLE;
  return value;
}

Value CompileDot(Program& program, const Arguments& arguments) {
  ExpectSize(arguments[1], arguments[0].size(), "two vectors of equal size");
  return {{Algebra(program).Dot(arguments[0].nodes, arguments[1].nodes)}};
}

Value CompileNorm(Program& program, const Arguments& arguments) {
  return {{Algebra(program).Norm(arguments[0].nodes)}};
}

Value CompileCross(Program& program, const Arguments& arguments) {
  for (const Value& argument : arguments) ExpectSize(argument, 3, "two vectors of 3 elements");
  return {Algebra(program).Cross(arguments[0].nodes, arguments[1].nodes),
          ALIDADE_VECTOR,
          {"x", "y", "z"}};
}

Value CompileUnit(Program& program, const Arguments& arguments) {
  ExpectSize(arguments[0], 3, "a vector of 3 elements");
  const Value norm{{Algebra(program).Norm(arguments[0].nodes)}};
  Value value = CompileOperator(program, Op::kDivide, arguments[0], norm);
  value.geometry = ALIDADE_UNIT_VECTOR;
  return value;
}

template <bool kIsInverse>
Value CompileRotate(Program& program, const Arguments& arguments) {
  constexpr const char* kNeeded = "a unit quaternion and a vector of 3 elements";
  ExpectSize(arguments[0], kQuaternionSize, kNeeded);
  ExpectSize(arguments[1], 3, kNeeded);
  const Value& v = arguments[1];
  Value value{Algebra(program).Rotate(arguments[0].nodes, v.nodes, kIsInverse)};
  value.elements = {"x", "y", "z"};
  if (v.geometry == ALIDADE_UNIT_VECTOR) value.geometry = v.geometry;
  return value;
}

Value CompileMultiply(Program& program, const Arguments& arguments) {
  for (const Value& argument : arguments)
    ExpectSize(argument, kQuaternionSize, "two unit quaternions");
  return {Algebra(program).Multiply(arguments[0].nodes, arguments[1].nodes),
          ALIDADE_UNIT_QUATERNION};
}

Value CompileConjugate(Program& program, const Arguments& arguments) {
  ExpectSize(arguments[0], kQuaternionSize, "a unit quaternion");
  Value value = arguments[0];
  for (std::size_t i = 1; i < kQuaternionSize; ++i) {
    value.nodes[i] = program.Add(Op::kNegate, value.nodes[i]);
  }
  value.geometry = ALIDADE_UNIT_QUATERNION;
  return value;
}

/// Returns Exp(d) = (cos |d|/2, sin(|d|/2) d / |d|) as a function of |d|^2 / 4, which is smooth at
/// d = 0.
Value CompileRotation(Program& program, const Arguments& arguments) {
  ExpectSize(arguments[0], 3, "a rotation vector of 3 elements");
  Algebra algebra(program);
  const std::vector<int>& d = arguments[0].nodes;
  const int squared = algebra.Scaled(0.25, algebra.Dot(d, d));
  const int half_sinc = algebra.Scaled(0.5, program.Add(Op::kSincOfRoot, squared));
  Value value{{program.Add(Op::kCosOfRoot, squared)}, ALIDADE_UNIT_QUATERNION};
  for (const int node : d) value.nodes.push_back(algebra.Product(half_sinc, node));
  return value;
}

constexpr std::array kFunctions = {
    Function{"sqrt", 1, "sqrt(x)", "square root; x > 0", EachElement<Op::kSqrt>},
    Function{"exp", 1, "exp(x)", "exponential function", EachElement<Op::kExp>},
    Function{"log", 1, "log(x)", "natural logarithm; x > 0", EachElement<Op::kLog>},
    Function{"pow", 2, "pow(x, y)", "x ^ y; x > 0 unless y is an integer", EachPair<Op::kPower>},
    Function{"abs", 1, "abs(x)", "absolute value", EachElement<Op::kAbs>},
    Function{"min", 2, "min(x, y)", "smaller value", EachPair<Op::kMin>},
    Function{"max", 2, "max(x, y)", "larger value", EachPair<Op::kMax>},
    Function{"sin", 1, "sin(a)", "sine of an angle in rad", EachElement<Op::kSin>},
    Function{"cos", 1, "cos(a)", "cosine", EachElement<Op::kCos>},
    Function{"tan", 1, "tan(a)", "tangent", EachElement<Op::kTan>},
    Function{"asin", 1, "asin(x)", "inverse of the sine; -1 < x < 1", EachElement<Op::kAsin>},
    Function{"acos", 1, "acos(x)", "inverse of the cosine; -1 < x < 1", EachElement<Op::kAcos>},
    Function{"atan", 1, "atan(x)", "inverse of the tangent", EachElement<Op::kAtan>},
    Function{"atan2", 2, "atan2(y, x)", "angle of the point (x, y); not at (0, 0)",
             EachPair<Op::kAtan2>},
    Function{"hypot", 2, "hypot(x, y)", "length of (x, y); not at (0, 0)", EachPair<Op::kHypot>},
    Function{"sinc", 1, "sinc(x)", "sin(x) / x; 1 at x = 0", EachElement<Op::kSinc>},
    Function{"wrap", 1, "wrap(a)", "angle in (-pi, pi]", EachElement<Op::kWrap>},
    Function{"dot", 2, "dot(a, b)", "scalar product of two vectors", CompileDot},
    Function{"cross", 2, "cross(a, b)", "vector product of two vectors of 3 elements",
             CompileCross},
    Function{"norm", 1, "norm(a)", "length of a vector; not at 0", CompileNorm},
    Function{"unit", 1, "unit(a)", "a / norm(a), a unit vector of 3 elements", CompileUnit},
    Function{"rotate", 2, "rotate(q, v)", "v turned by the unit quaternion q",
             CompileRotate<false>},
    Function{"rotate_inverse", 2, "rotate_inverse(q, v)", "v turned by the inverse of q",
             CompileRotate<true>},
    Function{"multiply", 2, "multiply(q, r)", "product of two unit quaternions", CompileMultiply},
    Function{"conjugate", 1, "conjugate(q)", "inverse of a unit quaternion", CompileConjugate},
    Function{"rotation", 1, "rotation(d)", "Exp(d): unit quaternion of a rotation vector in rad",
             CompileRotation},
};

}  // namespace

std::span<const Function> Functions() { return kFunctions; }

Value CompileOperator(Program& program, Op op, const Value& a, const Value& b) {
  const bool are_vectors = a.size() > 1 && b.size() > 1;
  if (are_vectors && a.size() != b.size()) {
    throw OperandError("the operands have " + std::to_string(a.size()) + " and " +
                           std::to_string(b.size()) + " elements",
                       "equal sizes, or a number and a vector");
  }
  if (are_vectors && op == Op::kMultiply)
    throw OperandError("the product of two vectors", "dot(a, b) or cross(a, b)");
  if (op == Op::kDivide && b.size() > 1)
    throw OperandError("a division by a vector", "a division by a number");
  Value value;
  for (std::size_t i = 0; i < std::max(a.size(), b.size()); ++i) {
    value.nodes.push_back(
        program.Add(op, a.nodes[a.size() == 1 ? 0 : i], b.nodes[b.size() == 1 ? 0 : i]));
  }
  const Value& vector = a.size() > 1 ? a : b;
  const bool has_other_names = are_vectors && b.elements != a.elements;
  if (value.size() > 1 && !has_other_names) value.elements = vector.elements;
  const bool is_sum = op == Op::kAdd || op == Op::kSubtract;
  const bool has_angle = a.geometry == ALIDADE_ANGLE || b.geometry == ALIDADE_ANGLE;
  if (is_sum && has_angle && value.size() == 1) value.geometry = ALIDADE_ANGLE;
  return value;
}

Value CompileNegation(Program& program, const Value& a) {
  Value value = a;
  for (int& node : value.nodes) node = program.Add(Op::kNegate, node);
  return value;
}

Value CompileQuaternionRate(Program& program, const Value& q, const Value& rate) {
  Algebra algebra(program);
  std::vector<int> half_rate = {program.Constant(0.0)};
  for (const int node : rate.nodes) half_rate.push_back(algebra.Scaled(0.5, node));
  return {algebra.Multiply(q.nodes, half_rate)};
}

}  // namespace alidade::internal
