// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/projection.h"

#include <algorithm>
#include <array>

#include "alidade/state/small_kernels.h"
#include "alidade/state/vector_kernels.h"

namespace alidade {
namespace {

/// What the M rows of H from `first` on add to s += H P H'; returns M. Of two entries of P that are
/// one by symmetry it takes the lower one, for both, and half of each on the diagonal.
template <int M>
int AddRows(const ConstLowerTriangle& p, const JacobianRows& h, int first, double* s) {
  const auto row = [&](int i) { return h.data + std::ptrdiff_t{i} * h.stride; };
  for (const JacobianPart& right : h.parts) {
    for (int c = 0; c < right.size; ++c) {
      const int b = right.offset + c;
      double hp[M] = {};  // H times column b of the lower triangle of P
      const auto add = [&](int column, double value) {
        for (int i = 0; i < M; ++i) hp[i] += row(first + i)[column] * value;
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
      for (int i = 0; i < M; ++i) {
        for (int k = 0; k < h.rows; ++k) {
          const double both = hp[i] * row(k)[right.column + c];
          s[(first + i) * h.rows + k] += both;
          s[k * h.rows + first + i] += both;
        }
      }
    }
  }
  return M;
}

}  // namespace

void AddProjection(const Covariance& p, const JacobianRows& h, double* s) {
  if (internal::IsSmall(p) && h.whole && h.rows <= internal::kSmall) {
    std::array<double, internal::kSmall * internal::kSmall> pht;
    return Project(p, h, pht.data(), s);
  }
  const ConstLowerTriangle lower = p.lower();
  for (int first = 0; first < h.rows;) {
    switch (h.rows - first) {
      case 1:
        first += AddRows<1>(lower, h, first, s);
        break;
      case 2:
        first += AddRows<2>(lower, h, first, s);
        break;
      default:
        first += AddRows<3>(lower, h, first, s);
    }
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
