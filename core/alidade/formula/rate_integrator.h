// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "alidade/formula/compiled_function.h"

namespace alidade::internal {

/// Integrates dx/dt = f(x, u, w(t)) over one step by the Runge-Kutta method of order 4, with
/// the derivatives of the result.
///
/// White noise of density sigma^2 is represented by its first K Legendre terms,
///
///   w(t) = sum_k w_k sqrt(2 k + 1) P_k(2 t / dt - 1),   w_k ~ N(0, sigma^2 / dt),   k < K,
///
/// so that Q is exact for noise that passes through at most K integrators. The stages of the method
/// see P_2 with the factor 2/5. The integral of w, the double and the triple integral are then
/// exact for K = 3, which is not the case for the values of P_2.
class RateIntegrator {
 public:
  /// Largest K.
  static constexpr int kMaxTerms = 3;

  /// The inputs of `rate` are the blocks, the control input if `has_input` is true, and the noise.
  /// Its outputs are the rates of the ambient elements of the blocks.
  RateIntegrator(CompiledFunction rate, const std::vector<Space>& blocks, bool has_input,
                 bool is_discrete);

  /// Returns K: the largest number of integrators between a noise and a block, at most kMaxTerms; 1
  /// for noise that is constant in a step.
  int terms() const { return terms_; }
  /// Computes the ambient values `next`, and F and G if `f` is not null. `w` contains the terms of
  /// the first noise, then those of the second noise, and so on.
  Status Step(const double* const* blocks, const double* input, const double* w, double dt_s,
              double* next, double* f, double* g) const;

 private:
  int CountTerms() const;
  /// Computes the derivatives of the rate of a stage with respect to the blocks and noise terms,
  /// A (I + shift_s S) + (0 B P). `partial` contains A = df/dx and B = df/dw. `slope` contains the
  /// result S of the previous stage, and `legendre` contains P.
  void AdvanceSlope(const double* partial, const std::array<double, kMaxTerms>& legendre,
                    double shift_s, const double* slope, double* moved) const;

  CompiledFunction rate_;
  std::vector<Geometry> blocks_;
  std::vector<Geometry> differentiated_;  ///< blocks, and the terms of the noise
  int states_ = 0;                        ///< ambient elements of the blocks
  int tangent_ = 0;                       ///< tangent elements of the blocks
  int inputs_ = 0;                        ///< elements of the control input
  int noises_ = 0;
  int terms_ = 1;
};

}  // namespace alidade::internal
