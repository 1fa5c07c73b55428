// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/projection.h"

#include <algorithm>
#include <array>

#include "alidade/state/small_kernels.h"
#include "alidade/state/vector_kernels.h"

namespace alidade {
namespace {

/// Calls take(hp, column) for each column of H that P meets, hp the M rows of H from `first` on
/// times that column of P. Of two entries of P that are one by symmetry it takes the lower one, for
/// both, and half of each on the diagonal.
template <int M, class Take>
void ForEachColumn(const ConstLowerTriangle& p, const JacobianRows& h, int first,
                   const Take& take) {
  std::array<const double*, M> rows;
  for (int i = 0; i < M; ++i) rows[i] = h.data + std::ptrdiff_t{first + i} * h.stride;
  for (const JacobianPart& right : h.parts) {
    for (int c = 0; c < right.size; ++c) {
      const int b = right.offset + c;
      std::array<double, M> hp = {};
      const auto add = [&](int column, double value) {
        for (int i = 0; i < M; ++i) hp[i] += rows[i][column] * value;
      };
      add(right.column + c, 0.5 * p(b, b));
      for (int d = c + 1; d < right.size; ++d) add(right.column + d, p(right.offset + d, b));
      for (const JacobianPart& left : h.parts) {
        if (left.offset > right.offset) {
          for (int d = 0; d < left.size; ++d) add(left.column + d, p(left.offset + d, b));
        } else if (left.offset == right.offset && &left > &right) {  // two roles of one block
          for (int d = 0; d < left.size; ++d) {
            add(left.column + d, p(left.offset + std::max(c, d), left.offset + std::min(c, d)));
          }
        }
      }
      take(hp, right.column + c);
    }
  }
}

/// s += H P H' of the M rows that H has. Sums are kept apart from s, in registers.
template <int M>
void AddAll(const ConstLowerTriangle& p, const JacobianRows& h, double* s) {
  std::array<double, M* M> half = {};
  ForEachColumn<M>(p, h, 0, [&](const std::array<double, M>& hp, int column) {
    for (int i = 0; i < M; ++i) {
      for (int k = 0; k < M; ++k) half[i * M + k] += hp[i] * h.data[k * h.stride + column];
    }
  });
  for (int i = 0; i < M; ++i) {
    for (int k = 0; k < M; ++k) s[i * M + k] += half[i * M + k] + half[k * M + i];
  }
}

/// What the row `i` of H adds to s += H P H'.
void AddRow(const ConstLowerTriangle& p, const JacobianRows& h, int i, double* s) {
  ForEachColumn<1>(p, h, i, [&](const std::array<double, 1>& hp, int column) {
    for (int k = 0; k < h.rows; ++k) {
      const double both = hp[0] * h.data[std::ptrdiff_t{k} * h.stride + column];
      s[i * h.rows + k] += both;
      s[k * h.rows + i] += both;
    }
  });
}

}  // namespace

void AddProjection(const Covariance& p, const JacobianRows& h, double* s) {
  if (internal::IsSmall(p) && h.whole && h.rows <= internal::kSmall) {
    std::array<double, internal::kSmall * internal::kSmall> pht;
    return Project(p, h, pht.data(), s);
  }
  const ConstLowerTriangle lower = p.lower();
  switch (h.rows) {
    case 1:
      return AddAll<1>(lower, h, s);
    case 2:
      return AddAll<2>(lower, h, s);
    case 3:
      return AddAll<3>(lower, h, s);
    default:
      for (int i = 0; i < h.rows; ++i) AddRow(lower, h, i, s);
  }
}

void Project(const Covariance& p, const JacobianRows& h, double* pht, double* s) {
  const ConstLowerTriangle lower = p.lower();
  if (internal::IsSmall(p) && h.whole) {
    const int ld = static_cast<int>(lower.outerStride());
    return internal::SmallKernelsFor(p.size()).project(lower.data(), ld, h.data, h.rows, pht, s);
  }
  const long n = p.size();
  internal::BestVectorKernels().project(lower.data(), lower.outerStride(), n, {&h, 1}, pht, 1, n);
  for (int i = 0; i < h.rows; ++i) {
    for (int k = 0; k < h.rows; ++k) {
      double sum = 0.0;
      for (const JacobianPart& part : h.parts) {
        const double* const j = h.data + static_cast<std::ptrdiff_t>(i) * h.stride + part.column;
        for (int c = 0; c < part.size; ++c) sum += j[c] * pht[k * n + part.offset + c];
      }
      s[i * h.rows + k] += sum;
    }
  }
}

void Project(const Covariance& p, std::span<const JacobianRows> rows, const internal::Panels& pht) {
  const ConstLowerTriangle lower = p.lower();
  internal::BestVectorKernels().project(lower.data(), lower.outerStride(), p.size(), rows, pht.data,
                                        pht.columns, pht.height);
}

}  // namespace alidade
