// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

#include "alidade/state/instruction_set.h"
#include "alidade/state/jacobian_rows.h"

/// Arithmetic of a Kalman filter on raw memory. kernels.cc contains each kernel once, for columns
/// of a few rows. It is compiled for 1 to 8 states, with unrolled loops. For any number of states
/// it is compiled for panels of vector registers, once for each instruction set. The results of the
/// sets differ only by rounding.
namespace alidade::internal {

/// Returns the size of memory for n rows or columns, in whole cache lines.
constexpr int PaddedSize(int n) { return (n + 7) & ~7; }

/// View of a symmetric n x n matrix by columns, of which only the lower triangle is used. Its
/// memory has PaddedSize(n) rows and columns. The lower triangle beyond n is zero.
struct SymmetricView {
  double* data;
  int size, stride;

  double& operator()(int i, int j) const {
    return i >= j ? data[std::ptrdiff_t{j} * stride + i] : data[std::ptrdiff_t{i} * stride + j];
  }
};

/// Measurement of an update, linearised at the state.
struct MeasurementRows {
  JacobianRows h;
  const double* innovation;  ///< m
  const double* noise;       ///< R, m x m
  double* s;                 ///< m x m, output of Kernels::nis: S = H P H' + R
  int column = 0;            ///< first column in the update
};

/// Update of n states by m rows, in memory of the caller.
///
///   S = H P H' + R = L D L'     W = P H' L^-T     dx = W D^-1 L^-1 r     K = W D^-1 L^-1
///   P' = P - W D^-1 W'
///
/// P H', W and K are n x m in panels of Kernels::panel_rows rows, each panel by columns: see At().
struct Update {
  SymmetricView p;
  std::span<const MeasurementRows* const> measurements;  ///< in the order of their columns
  int m;
  int capacity;  ///< of a panel, in columns
  int panel_rows;
  double* w;                  ///< PaddedSize(n) x capacity: P H', then W
  double* s;                  ///< PaddedSize(capacity) x capacity by columns: S, then L
  double* inverse_d;          ///< capacity
  double* y;                  ///< capacity: L^-1 r
  double* dx;                 ///< PaddedSize(n)
  double* variance_decrease;  ///< PaddedSize(n): the diagonal of W D^-1 W'
  double* gain;               ///< K, of the size of w; null if K is not needed

  /// Returns element (i, j) of a matrix in panels.
  double& At(double* panels, int i, int j) const {
    if (i < panel_rows) return panels[std::ptrdiff_t{j} * panel_rows + i];
    const int row = i % panel_rows;
    return panels[std::ptrdiff_t{i - row} * capacity + std::ptrdiff_t{j} * panel_rows + row];
  }
};

/// Result of Kernels::solve, from best to worst.
enum class Solution {
  kOk,
  kCancellation,  ///< P - W D^-1 W' would lose nearly all digits of a variance
  kNotPositiveDefinite,
  kNotFinite,
};

/// Transition x' = F x + N v, v ~ N(0, I), C = Cov(F x, N v), of the k states in `rows`.
struct Transition {
  std::span<const int> rows;
  const double* f;      ///< F, k x k by rows
  const double* noise;  ///< N, k x width by rows
  int width;
  const double* cross;  ///< C, k x k by rows; null: zero
  double* memory;       ///< MemoryOf(n, k, width)

  /// Returns the size of `memory` for a step of k of n states.
  static std::size_t MemoryOf(int n, int k, int width) {
    return static_cast<std::size_t>(k) *
               static_cast<std::size_t>(2 * PaddedSize(n) + 2 * PaddedSize(k) + k) +
           static_cast<std::size_t>(width) * static_cast<std::size_t>(PaddedSize(k));
  }
};

/// Kernels for an instruction set or a small number of states.
struct Kernels {
  const char* name;  ///< of the instruction set: `baseline`, `AVX2`, `AVX-512`
  int panel_rows;
  // The elements of an array are compiled for 1 row, 2 rows and any number of rows: see For().
  /// Computes P H' of a measurement, in the columns of w from `measurement.column` on, and its S.
  /// Returns the NIS, r' S^-1 r, or NaN if S is not finite and positive definite. Overwrites s,
  /// inverse_d and y.
  double (*nis[3])(const Update& update, const MeasurementRows& measurement);
  /// Computes all of an update except P', from the P H' of `nis`.
  Solution (*solve[3])(const Update& update);
  /// Replaces P by P'.
  void (*downdate[3])(const Update& update);
  /// Replaces P by the covariance of x'. Returns false and leaves P unchanged if it would not be
  /// finite.
  bool (*propagate)(const SymmetricView& p, const Transition& step);

  /// Returns the element of an array for m rows.
  template <class Kernel>
  static Kernel For(Kernel const (&kernels)[3], int m) {
    return kernels[m <= 2 ? m - 1 : 2];
  }
};

/// Returns the unrolled kernels for 1 to 8 states with a stride of 8, else the vector kernels of
/// BestInstructionSet().
const Kernels& KernelsFor(const SymmetricView& p);
/// Returns the vector kernels of an instruction set, for any number of states.
const Kernels& KernelsOf(InstructionSet set);

}  // namespace alidade::internal
