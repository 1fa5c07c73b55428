// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

#include "alidade/state/instruction_set.h"
#include "alidade/state/jacobian_rows.h"

/// Arithmetic of a Kalman filter on raw memory. kernels.cc contains the source of each kernel once.
/// The source is compiled with unrolled loops for each number of states from 1 to 8. For any number
/// of states, it is compiled once for each instruction set. These kernels process panels of vector
/// registers. The results of the instruction sets differ only by rounding.
namespace alidade::internal {

/// Rounds n up to a multiple of 8, so that a row or column of n numbers fills whole cache lines.
constexpr int PaddedSize(int n) { return (n + 7) & ~7; }

/// View of a symmetric n x n matrix, stored column by column. Only the lower triangle is used. The
/// memory has PaddedSize(n) rows and columns. The lower triangle beyond n is zero.
struct SymmetricView {
  double* data;
  int size, stride;

  double& operator()(int i, int j) const {
    return i >= j ? data[std::ptrdiff_t{j} * stride + i] : data[std::ptrdiff_t{i} * stride + j];
  }
};

/// Measurement of an update, linearised about the state.
struct MeasurementRows {
  JacobianRows h;
  const double* innovation;  ///< innovation, m
  const double* noise;       ///< noise covariance R, m x m
  double* s;                 ///< m x m, output of Kernels::nis: S = H P H' + R
  int column = 0;            ///< first column of this measurement in P H' of the update
};

/// Update of n states by m rows of measurements. The caller owns the memory.
///
///   S = H P H' + R = L D L'     W = P H' L^-T     dx = W D^-1 L^-1 r     K = W D^-1 L^-1
///   P' = P - W D^-1 W'
///
/// P H', W and K are n x m. They are stored in panels of Kernels::panel_rows rows. Each panel is
/// stored column by column (see At).
struct Update {
  SymmetricView p;
  /// Measurements, in the order of their columns.
  std::span<const MeasurementRows* const> measurements;
  int m;
  int capacity;  ///< number of columns for which a panel has memory
  int panel_rows;
  double* w;                  ///< P H', replaced by W; PaddedSize(n) x capacity
  double* s;                  ///< S, replaced by L; column-major; PaddedSize(capacity) x capacity
  double* inverse_d;          ///< reciprocals of D; size `capacity`
  double* y;                  ///< L^-1 r; size `capacity`
  double* dx;                 ///< correction of the state; size PaddedSize(n)
  double* variance_decrease;  ///< diagonal of W D^-1 W'; size PaddedSize(n)
  double* gain;               ///< K, with the size of w; null if K is not needed

  /// Returns element (i, j) of a matrix in panels.
  double& At(double* panels, int i, int j) const {
    if (i < panel_rows) return panels[std::ptrdiff_t{j} * panel_rows + i];
    const int row = i % panel_rows;
    return panels[std::ptrdiff_t{i - row} * capacity + std::ptrdiff_t{j} * panel_rows + row];
  }
};

/// Outcome of Kernels::solve, from best to worst.
enum class Solution {
  kOk,
  kCancellation,  ///< P - W D^-1 W' would lose nearly all digits of a variance
  kNotPositiveDefinite,
  kNotFinite,
};

/// Transition x' = F x + N v, v ~ N(0, I), C = Cov(F x, N v), of the k states in `rows`.
struct Transition {
  std::span<const int> rows;
  const double* f;      ///< F, k x k, row-major
  const double* noise;  ///< N, k x width, row-major
  int width;
  const double* cross;  ///< C, k x k, row-major; null means zero
  double* memory;       ///< scratch memory of MemoryOf(n, k, width) numbers

  /// Returns the size of `memory` for a step that changes k of n states.
  static std::size_t MemoryOf(int n, int k, int width) {
    return static_cast<std::size_t>(k) *
               static_cast<std::size_t>(2 * PaddedSize(n) + 2 * PaddedSize(k) + k) +
           static_cast<std::size_t>(width) * static_cast<std::size_t>(PaddedSize(k));
  }
};

/// Kernels for one instruction set, or for one small number of states.
struct Kernels {
  const char* name;  ///< name of the instruction set: `baseline`, `AVX2`, `AVX-512`
  int panel_rows;
  // The three kernels of an array are compiled for 1 row, 2 rows and any number of rows (see For).
  /// Computes S and P H' of a measurement. Writes P H' to the columns of w from
  /// `measurement.column` on. Returns the NIS, r' S^-1 r, or NaN unless S is finite and positive
  /// definite. Overwrites s, inverse_d and y.
  double (*nis[3])(const Update& update, const MeasurementRows& measurement);
  /// Computes the results of an update except P'. `nis` must have computed P H' of each
  /// measurement.
  Solution (*solve[3])(const Update& update);
  /// Replaces P by P'.
  void (*downdate[3])(const Update& update);
  /// Replaces P by the covariance of x'. Returns false and leaves P unchanged if the new P would
  /// not be finite.
  bool (*propagate)(const SymmetricView& p, const Transition& step);

  /// Returns the kernel of an array for m rows.
  template <class Kernel>
  static Kernel For(Kernel const (&kernels)[3], int m) {
    return kernels[m <= 2 ? m - 1 : 2];
  }
};

/// Returns the unrolled kernels if `p` has 1 to 8 states and a stride of 8. Otherwise returns the
/// vector kernels of BestInstructionSet().
const Kernels& KernelsFor(const SymmetricView& p);
/// Returns the vector kernels of an instruction set, for any number of states.
const Kernels& KernelsOf(InstructionSet set);

}  // namespace alidade::internal
