// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

#include "alidade/state/instruction_set.h"
#include "alidade/state/jacobian_rows.h"

/// The arithmetic of a Kalman filter on raw memory. Each kernel is written once, over columns of a
/// few rows (kernels.cc): compiled for 1 to 8 states, with loops that unroll, and for any number of
/// states in panels of vector registers, once for each instruction set. The sets differ by rounding
/// alone.
namespace alidade::internal {

/// The size of memory for n rows or columns: whole cache lines.
constexpr int PaddedSize(int n) { return (n + 7) & ~7; }

/// A symmetric n x n matrix by columns, of which the lower triangle counts. Its memory has
/// PaddedSize(n) rows and columns; the lower triangle of those beyond n is zero.
struct SymmetricView {
  double* data;
  int size, stride;

  double& operator()(int i, int j) const {
    return i >= j ? data[std::ptrdiff_t{j} * stride + i] : data[std::ptrdiff_t{i} * stride + j];
  }
};

/// One measurement of an update, linearised at the state.
struct MeasurementRows {
  JacobianRows h;
  const double* innovation;  ///< m
  const double* noise;       ///< R, m x m
  double* s;                 ///< m x m, of Kernels::nis: S = H P H' + R
  int column = 0;            ///< its first one in the update
};

/// An update of n states by m rows, in memory of the caller.
///
///   S = H P H' + R = L D L'     W = P H' L^-T     dx = W D^-1 L^-1 r     K = W D^-1 L^-1
///   P' = P - W D^-1 W'
///
/// P H', W and K are n x m in panels of Kernels::panel_rows rows, each panel by columns: see At().
struct Update {
  SymmetricView p;
  std::span<const MeasurementRows* const> measurements;  ///< one after the other
  int m;
  int capacity;  ///< columns that a panel has room for
  int panel_rows;
  double* w;          ///< PaddedSize(n) x capacity: P H', then W
  double* s;          ///< PaddedSize(capacity) x capacity by columns: S, then L
  double* inverse_d;  ///< capacity
  double* y;          ///< capacity: L^-1 r
  double* dx;         ///< PaddedSize(n)
  double* lost;       ///< PaddedSize(n): the diagonal of W D^-1 W'
  double* gain;       ///< as w: K; null: not wanted

  /// Element (i, j) of a matrix in panels.
  double& At(double* panels, int i, int j) const {
    if (i < panel_rows) return panels[std::ptrdiff_t{j} * panel_rows + i];
    const int row = i % panel_rows;
    return panels[std::ptrdiff_t{i - row} * capacity + std::ptrdiff_t{j} * panel_rows + row];
  }
};

/// What Kernels::solve found, from good to bad.
enum class Solution {
  kFine,
  kCancels,  ///< P - W D^-1 W' would lose nearly all digits of a variance
  kNotPositiveDefinite,
  kNotFinite,
};

/// x' = F x + N v, v ~ N(0, I), C = Cov(F x, N v), of the k states in `rows`.
struct Transition {
  std::span<const int> rows;
  const double* f;      ///< F, k x k by rows
  const double* noise;  ///< N, k x width by rows
  int width;
  const double* cross;  ///< C, k x k by rows; null: zero
  double* memory;       ///< MemoryOf(n, k, width)

  /// How many numbers a step of k of n states needs.
  static std::size_t MemoryOf(int n, int k, int width) {
    return static_cast<std::size_t>(k) *
               static_cast<std::size_t>(2 * PaddedSize(n) + 2 * PaddedSize(k) + k) +
           static_cast<std::size_t>(width) * static_cast<std::size_t>(PaddedSize(k));
  }
};

struct Kernels {
  const char* name;  ///< of the instruction set: `baseline`, `AVX2`, `AVX-512`
  int panel_rows;
  // Each of an array is compiled for 1 row, 2 rows and any number: see For().
  /// P H' of one measurement in the columns of w from `one.column` on, and its S. Returns the NIS,
  /// r' S^-1 r; not a number unless S is finite and positive definite. Writes over s, inverse_d, y.
  double (*nis[3])(const Update& update, const MeasurementRows& one);
  /// All of an update but P', of the P H' that `nis` made.
  Solution (*solve[3])(const Update& update);
  /// P' in place of P.
  void (*downdate[3])(const Update& update);
  /// P of x' in place of P. False, and P is as it was, if it would not be finite.
  bool (*propagate)(const SymmetricView& p, const Transition& step);

  /// Of a kernel, the one for m rows.
  template <class Kernel>
  static Kernel For(Kernel const (&kernels)[3], int m) {
    return kernels[m <= 2 ? m - 1 : 2];
  }
};

/// For 1 to 8 states of a stride of 8 those whose loops unroll; else the vectors of
/// BestInstructionSet().
const Kernels& KernelsFor(const SymmetricView& p);
/// For any number of states, by the vectors of an instruction set.
const Kernels& KernelsOf(InstructionSet set);

}  // namespace alidade::internal
