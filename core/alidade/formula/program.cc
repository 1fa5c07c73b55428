// SPDX-License-Identifier: Apache-2.0
#include "alidade/formula/program.h"

#include <algorithm>
#include <cmath>

#include "alidade/model/geometry.h"

namespace alidade::internal {
namespace {

/// Value of an operation, and its derivatives with respect to the operands.
struct Result {
  double value = 0.0, x = 0.0, y = 0.0;
};

/// Returns sin(a) / a.
double Sinc(double a) {
  constexpr double kSeries = 1e-4;
  return std::abs(a) < kSeries ? 1.0 - a * a / 6.0 : std::sin(a) / a;
}

/// Returns (cos(a) - sinc(a)) / a^2, the derivative of sinc(a) divided by a.
double SincSlope(double a) {
  constexpr double kSeries = 1e-2;
  if (std::abs(a) >= kSeries) return (std::cos(a) - Sinc(a)) / (a * a);
  const double squared = a * a;
  return -1.0 / 3.0 + squared / 30.0 - squared * squared / 840.0;
}

bool Power(double x, double y, Result& r) {
  const bool is_integer = y == std::floor(y);
  if (is_integer ? (x == 0.0 && y < 1.0) : !(x > 0.0)) return false;
  r = {std::pow(x, y), y * std::pow(x, y - 1.0), 0.0};
  if (x > 0.0) r.y = r.value * std::log(x);
  return true;
}

/// Computes a trigonometric function. Returns false if the value or the derivative is not defined.
bool ComputeTrigonometric(Op op, double x, Result& r) {
  switch (op) {
    case Op::kSin:
      r = {std::sin(x), std::cos(x)};
      return true;
    case Op::kCos:
      r = {std::cos(x), -std::sin(x)};
      return true;
    case Op::kTan: {
      const double tangent = std::tan(x);
      r = {tangent, 1.0 + tangent * tangent};
      return true;
    }
    case Op::kAsin:
      r = {std::asin(x), 1.0 / std::sqrt(1.0 - x * x)};
      return std::abs(x) < 1.0;
    case Op::kAcos:
      r = {std::acos(x), -1.0 / std::sqrt(1.0 - x * x)};
      return std::abs(x) < 1.0;
    case Op::kAtan:
      r = {std::atan(x), 1.0 / (1.0 + x * x)};
      return true;
    case Op::kWrap:
      r = {Angle::Wrap(x), 1.0};
      return true;
    case Op::kSinc:
      r = {Sinc(x), x * SincSlope(x)};
      return true;
    case Op::kCosOfRoot: {
      const double root = std::sqrt(x);
      r = {std::cos(root), -0.5 * Sinc(root)};
      return x >= 0.0;
    }
    case Op::kSincOfRoot: {
      const double root = std::sqrt(x);
      r = {Sinc(root), 0.5 * SincSlope(root)};
      return x >= 0.0;
    }
    default:
      return false;
  }
}

/// Computes another function of one or two numbers.
bool ComputeFunction(Op op, double x, double y, Result& r) {
  switch (op) {
    case Op::kPower:
      return Power(x, y, r);
    case Op::kHypot: {
      const double length = std::sqrt(x * x + y * y);
      r = {length, x / length, y / length};
      return length > 0.0;
    }
    case Op::kAtan2: {
      const double squared = x * x + y * y;
      r = {std::atan2(x, y), y / squared, -x / squared};
      return squared > 0.0;
    }
    case Op::kMin:
      r = x <= y ? Result{x, 1.0, 0.0} : Result{y, 0.0, 1.0};
      return true;
    case Op::kMax:
      r = x >= y ? Result{x, 1.0, 0.0} : Result{y, 0.0, 1.0};
      return true;
    case Op::kSqrt: {
      const double root = std::sqrt(x);
      r = {root, 0.5 / root};
      return x > 0.0;
    }
    case Op::kExp:
      r.value = r.x = std::exp(x);
      return true;
    case Op::kLog:
      r = {std::log(x), 1.0 / x};
      return x > 0.0;
    case Op::kAbs:
      r = {std::abs(x), x < 0.0 ? -1.0 : 1.0};
      return true;
    default:
      return ComputeTrigonometric(op, x, r);
  }
}

/// Computes an operation that is neither a variable nor a constant. Returns false if the value or a
/// derivative is not defined.
inline bool Compute(Op op, double x, double y, Result& r) {
  switch (op) {
    case Op::kAdd:
      r = {x + y, 1.0, 1.0};
      return true;
    case Op::kSubtract:
      r = {x - y, 1.0, -1.0};
      return true;
    case Op::kMultiply:
      r = {x * y, y, x};
      return true;
    case Op::kDivide:
      r = {x / y, 1.0 / y, -x / (y * y)};
      return y != 0.0;
    case Op::kNegate:
      r = {-x, -1.0};
      return true;
    default:
      return ComputeFunction(op, x, y, r);
  }
}

}  // namespace

Program::Program(int variables) : variables_(variables) {
  nodes_.assign(static_cast<std::size_t>(variables), Operation{Op::kVariable});
}

int Program::Constant(double value) { return Append({Op::kConstant, -1, -1, value}); }

int Program::Add(Op op, int x, int y) {
  const std::optional<double> a = ConstantValue(x);
  const std::optional<double> b = y < 0 ? std::optional(0.0) : ConstantValue(y);
  Result result;
  if (a && b && Compute(op, *a, *b, result) && std::isfinite(result.value))
    return Constant(result.value);
  switch (op) {
    case Op::kAdd:
      if (a == 0.0) return y;
      if (b == 0.0) return x;
      break;
    case Op::kSubtract:
      if (b == 0.0) return x;
      if (a == 0.0) return Add(Op::kNegate, y);
      break;
    case Op::kMultiply:
      if (a == 0.0 || b == 0.0) return Constant(0.0);
      if (a == 1.0) return y;
      if (b == 1.0) return x;
      break;
    case Op::kDivide:
      if (b == 1.0) return x;
      break;
    case Op::kPower:
      if (b == 1.0) return x;
      if (b == 2.0) return Add(Op::kMultiply, x, x);
      if (b == 0.5) return Add(Op::kSqrt, x);
      break;
    default:
      break;
  }
  return Append({op, x, y});
}

std::optional<double> Program::ConstantValue(int node) const {
  const Operation& n = nodes_[static_cast<std::size_t>(node)];
  return n.op == Op::kConstant ? std::optional(n.value) : std::nullopt;
}

Program::Sweep Program::SweepFrom(int node) const {
  std::vector<bool> is_used(nodes_.size());
  is_used[static_cast<std::size_t>(node)] = true;
  Sweep sweep;
  for (int i = node; i >= 0; --i) {
    if (!is_used[static_cast<std::size_t>(i)]) continue;
    sweep.push_back(i);
    const Operation& n = nodes_[static_cast<std::size_t>(i)];
    for (const int operand : {n.x, n.y})
      if (operand >= 0) is_used[static_cast<std::size_t>(operand)] = true;
  }
  return sweep;
}

bool Program::Evaluate(const double* x, bool with_slopes, Tape& tape) const {
  for (int i = 0; i < variables_; ++i) tape.value[i] = x[i];
  double undefined = 0.0;  // NaN as soon as a value is not finite
  int i = variables_;
  for (const Operation* node = nodes_.data() + variables_; i < size(); ++i, ++node) {
    if (node->op == Op::kConstant) {
      tape.value[i] = node->value;
      continue;
    }
    const double a = tape.value[node->x], b = node->y < 0 ? 0.0 : tape.value[node->y];
    double value = 0.0, slope_a = 1.0, slope_b = 1.0;
    switch (node->op) {
      case Op::kAdd:
        value = a + b;
        break;
      case Op::kSubtract:
        value = a - b;
        slope_b = -1.0;
        break;
      case Op::kMultiply:
        value = a * b;
        slope_a = b;
        slope_b = a;
        break;
      default: {
        Result result;
        if (!Compute(node->op, a, b, result)) return false;
        value = result.value;
        slope_a = result.x;
        slope_b = result.y;
      }
    }
    undefined += 0.0 * value;
    tape.value[i] = value;
    if (!with_slopes) continue;
    tape.slope[i][0] = slope_a;
    tape.slope[i][1] = slope_b;
  }
  return undefined == 0.0;
}

void Program::Gradient(const Sweep& sweep, Tape& tape, double* gradient) const {
  for (int i = 0; i < variables_; ++i) tape.adjoint[i] = 0.0;
  for (const int i : sweep) tape.adjoint[i] = 0.0;
  tape.adjoint[sweep.front()] = 1.0;
  for (const int i : sweep) {
    const Operation& node = nodes_[static_cast<std::size_t>(i)];
    if (node.x < 0) continue;  // a variable or a constant
    const double adjoint = tape.adjoint[i];
    tape.adjoint[node.x] += adjoint * tape.slope[i][0];
    if (node.y >= 0) tape.adjoint[node.y] += adjoint * tape.slope[i][1];
  }
  for (int i = 0; i < variables_; ++i) gradient[i] = tape.adjoint[i];
}

int Program::Append(const Operation& operation) {
  const auto [found, is_new] = known_nodes_.try_emplace(
      {operation.op, operation.x, operation.y, operation.value}, static_cast<int>(nodes_.size()));
  if (is_new) nodes_.push_back(operation);
  return found->second;
}

}  // namespace alidade::internal
