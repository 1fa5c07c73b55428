// SPDX-License-Identifier: Apache-2.0
#include "alidade/formula/compiled_function.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "alidade/model/jet.h"

namespace alidade::internal {
namespace {

constexpr int kMaxSlope = 256;   // largest number of elements of a matrix C or T
constexpr int kMaxTangent = 16;  // largest number of rows of C

/// Returns whether values and differences have the same elements.
bool IsFlat(const Geometry& geometry) { return geometry.is_vector() || geometry.is_angle(); }

/// Computes C = d(y' (-) y)/dy' at y' = y, tangent x ambient.
void DifferentiateMinus(const Geometry& geometry, const double* y, double* c) {
  VisitGeometry(geometry.row().number, [&](auto g) {
    using G = decltype(g);
    static_assert(G::kTangent * G::kAmbient <= kMaxSlope && G::kTangent <= kMaxTangent);
    using Dual = Jet<double, G::kAmbient>;
    Dual moved[G::kAmbient], difference[G::kTangent];
    for (int i = 0; i < G::kAmbient; ++i) moved[i] = Dual(y[i], i);
    G::Minus(moved, y, difference);
    for (int i = 0; i < G::kTangent; ++i)
      std::copy_n(difference[i].v, G::kAmbient, c + i * G::kAmbient);
  });
}

/// Computes T = d(x (+) d)/dd at d = 0, ambient x tangent.
void DifferentiatePlus(const Geometry& geometry, const double* x, double* t) {
  VisitGeometry(geometry.row().number, [&](auto g) {
    using G = decltype(g);
    using Dual = Jet<double, G::kTangent>;
    Dual d[G::kTangent], sum[G::kAmbient];
    for (int i = 0; i < G::kTangent; ++i) d[i] = Dual(0.0, i);
    G::Plus(x, d, sum);
    for (int i = 0; i < G::kAmbient; ++i) std::copy_n(sum[i].v, G::kTangent, t + i * G::kTangent);
  });
}

/// Row-major matrix, with the distance between its rows.
struct Matrix {
  const double* data;
  int rows, columns, stride;
};

/// Computes c = a b.
void Multiply(const Matrix& a, const Matrix& b, double* c, int stride) {
  for (int i = 0; i < a.rows; ++i) {
    for (int j = 0; j < b.columns; ++j) {
      double sum = 0.0;
      for (int k = 0; k < a.columns; ++k) {
        sum += a.data[i * a.stride + k] * b.data[k * b.stride + j];
      }
      c[i * stride + j] = sum;
    }
  }
}

void Copy(const Matrix& a, double* c, int stride) {
  for (int i = 0; i < a.rows; ++i) std::copy_n(a.data + i * a.stride, a.columns, c + i * stride);
}

int AmbientSize(const std::vector<Geometry>& geometries) {
  int size = 0;
  for (const Geometry& geometry : geometries) size += geometry.ambient;
  return size;
}

void ExpectAtMost(int size, const char* noun, const Node& owner) {
  if (size <= CompiledFunction::kMaxElements) return;
  owner.Fail(
      "the " + std::string(noun) + " of the formula have " + std::to_string(size) + " elements",
      "at most " + std::to_string(CompiledFunction::kMaxElements));
}

}  // namespace

void ToTangent(const std::vector<Geometry>& outputs, const double* y,
               const std::vector<Geometry>& inputs, const double* const* x, const double* ambient,
               double* const* jacobians, const int* strides) {
  const int columns = AmbientSize(inputs);
  int column = 0;
  for (std::size_t k = 0; k < inputs.size(); column += inputs[k++].ambient) {
    if (jacobians[k] == nullptr) continue;
    const Geometry& input = inputs[k];
    double slope[kMaxSlope];
    if (!IsFlat(input)) DifferentiatePlus(input, x[k], slope);
    int row = 0, tangent_row = 0;
    for (const Geometry& output : outputs) {
      Matrix block{ambient + row * columns + column, output.ambient, input.ambient, columns};
      double* const destination = jacobians[k] + tangent_row * strides[k];
      double projected[kMaxSlope], product[CompiledFunction::kMaxElements * kMaxTangent];
      if (!IsFlat(output)) {
        DifferentiateMinus(output, y + row, projected);
        Multiply({projected, output.tangent, output.ambient, output.ambient}, block, product,
                 input.ambient);
        block = {product, output.tangent, input.ambient, input.ambient};
      }
      if (IsFlat(input)) {
        Copy(block, destination, strides[k]);
      } else {
        Multiply(block, {slope, input.ambient, input.tangent, input.tangent}, destination,
                 strides[k]);
      }
      row += output.ambient;
      tangent_row += output.tangent;
    }
  }
}

CompiledFunction::CompiledFunction(std::vector<Geometry> inputs, const Node& owner)
    : inputs_(std::move(inputs)), program_(AmbientSize(inputs_)) {
  ExpectAtMost(program_.variables(), "inputs", owner);
  int offset = 0;
  for (const Geometry& input : inputs_) {
    offsets_.push_back(offset);
    offset += input.ambient;
  }
}

void CompiledFunction::AddOutput(const Geometry& geometry, const Value& value, const Node& owner) {
  outputs_.push_back(geometry);
  for (const int node : value.nodes) {
    sweeps_.push_back(program_.SweepFrom(node));
    const auto constant = program_.ConstantValue(node);
    if (constant && geometry.is_vector()) constants_.push_back(*constant);
  }
  ExpectAtMost(static_cast<int>(sweeps_.size()), "results", owner);
  if (program_.size() <= Program::kMaxNodes) return;
  owner.Fail("the formula has too many operations",
             "at most " + std::to_string(Program::kMaxNodes));
}

void CompiledFunction::AddConditions(const std::vector<Condition>& conditions) {
  conditions_.insert(conditions_.end(), conditions.begin(), conditions.end());
}

bool CompiledFunction::EvaluateAmbient(const double* x, double* y, double* jacobian) const {
  Program::Tape tape;
  if (!program_.Evaluate(x, jacobian != nullptr, tape)) return false;
  for (const Condition& condition : conditions_) {
    const double value = tape.value[condition.node];
    if (!(condition.accepts_zero ? value >= 0.0 : value > 0.0)) return false;
  }
  const int count = static_cast<int>(sweeps_.size()), columns = program_.variables();
  for (int i = 0; i < count; ++i) {
    const Program::Sweep& sweep = sweeps_[static_cast<std::size_t>(i)];
    y[i] = tape.value[sweep.front()];
    if (jacobian != nullptr) program_.Gradient(sweep, tape, jacobian + i * columns);
  }
  if (jacobian == nullptr) return true;
  return std::all_of(jacobian, jacobian + count * columns,
                     [](double slope) { return std::isfinite(slope); });
}

Status CompiledFunction::Evaluate(const double* const* x, double* y, double* const* jacobians,
                                  const int* strides) const {
  const bool is_constant = constants_.size() == sweeps_.size() && conditions_.empty();
  if (is_constant && jacobians == nullptr) {
    std::ranges::copy(constants_, y);
    return Status::kOk;
  }
  double variables[kMaxElements], results[kMaxElements], ambient[kMaxElements * kMaxElements];
  for (std::size_t k = 0; k < inputs_.size(); ++k) {
    std::copy_n(x[k], inputs_[k].ambient, variables + offsets_[k]);
  }
  if (!EvaluateAmbient(variables, results, jacobians == nullptr ? nullptr : ambient))
    return Status::kOutOfDomain;
  double* result = results;
  for (const Geometry& output : outputs_) {
    if (!output.is_vector()) output.Normalise(result);
    result += output.ambient;
  }
  if (jacobians != nullptr) ToTangent(outputs_, results, inputs_, x, ambient, jacobians, strides);
  std::copy(results, result, y);
  return Status::kOk;
}

}  // namespace alidade::internal
