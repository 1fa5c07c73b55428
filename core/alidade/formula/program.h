// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <tuple>
#include <vector>

namespace alidade::internal {

/// Operation of a node. The comment is its value for the operands x and y.
enum class Op : std::uint8_t {
  kVariable,  ///< element of the argument of the program
  kConstant,
  kAdd,         ///< x + y
  kSubtract,    ///< x - y
  kMultiply,    ///< x y
  kDivide,      ///< x / y
  kNegate,      ///< -x
  kPower,       ///< x^y
  kHypot,       ///< sqrt(x^2 + y^2)
  kAtan2,       ///< angle of the point (y, x)
  kMin,         ///< smaller of x and y
  kMax,         ///< larger of x and y
  kSqrt,        ///< square root of x
  kSin,         ///< sin x
  kCos,         ///< cos x
  kTan,         ///< tan x
  kAsin,        ///< inverse of sin
  kAcos,        ///< inverse of cos
  kAtan,        ///< inverse of tan
  kExp,         ///< e^x
  kLog,         ///< natural logarithm of x
  kAbs,         ///< |x|
  kWrap,        ///< x - 2 pi k in (-pi, pi]
  kSinc,        ///< sin(x) / x; 1 at 0
  kCosOfRoot,   ///< cos(sqrt x), which is differentiable at 0
  kSincOfRoot,  ///< sin(sqrt x) / sqrt x, which is differentiable at 0
};

/// Straight-line program of scalar operations: a function of several variables, with its gradient
/// by a reverse sweep. Equal operations are one node, and operations on constants are evaluated
/// when they are added. Const members are thread-safe and do not allocate memory.
class Program {
 public:
  /// Largest number of nodes that a program may have when it is evaluated.
  static constexpr int kMaxNodes = 1024;
  /// Values of all nodes and of their derivatives with respect to the two operands.
  struct Tape {
    double value[kMaxNodes];
    double slope[kMaxNodes][2];
    double adjoint[kMaxNodes];
  };

  /// Nodes in the order of a reverse sweep.
  using Sweep = std::vector<int>;

  /// The nodes 0 to `variables` - 1 are the variables.
  explicit Program(int variables);

  int variables() const { return variables_; }
  int size() const { return static_cast<int>(nodes_.size()); }
  int Constant(double value);
  /// Returns the node of an operation. `y` is -1 if the operation has one operand.
  int Add(Op op, int x, int y = -1);
  /// Returns the value of a node that is a constant.
  std::optional<double> ConstantValue(int node) const;
  /// Returns `node` and all nodes on which it depends, in descending order.
  Sweep SweepFrom(int node) const;

  /// Computes all nodes. Returns false if a node, or its derivative, is not defined. Slopes are
  /// computed only if `with_slopes` is true.
  bool Evaluate(const double* x, bool with_slopes, Tape& tape) const;
  /// Computes the gradient of the first node of `sweep` with respect to the variables, from a tape
  /// with slopes.
  void Gradient(const Sweep& sweep, Tape& tape, double* gradient) const;

 private:
  struct Operation {
    Op op;
    int x = -1, y = -1;
    double value = 0.0;  ///< of a constant
  };

  int Append(const Operation& operation);

  int variables_;
  std::vector<Operation> nodes_;
  std::map<std::tuple<Op, int, int, double>, int> known_nodes_;
};

}  // namespace alidade::internal
