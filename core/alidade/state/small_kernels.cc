// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/small_kernels.h"

#include <algorithm>
#include <array>
#include <utility>

namespace alidade::internal {
namespace {

template <int N>
void PropagateLower(double* p, int ld, int o, int k, const double* f, const double* q) {
  double whole[N][N];
  Load(p, ld, whole);
  Propagate<N, 0>(whole, o, k, f, q);
  Store(whole, p, ld);
}

template <int N>
bool DowndateLower(double* p, int ld, int m, const double* w, const double* inverse_d) {
  double updated[N * N];
  if (!Downdate<N, 0>(p, ld, m, w, inverse_d, updated)) return false;
  for (int c = 0; c < N; ++c) std::copy(updated + c * N + c, updated + c * N + N, p + c * ld + c);
  return true;
}

template <std::size_t... I>
constexpr std::array<SmallKernels, kSmall> Table(std::index_sequence<I...>) {
  return {SmallKernels{Project<static_cast<int>(I) + 1>, PropagateLower<static_cast<int>(I) + 1>,
                       Solve<static_cast<int>(I) + 1, 0>,
                       DowndateLower<static_cast<int>(I) + 1>}...};
}

constexpr std::array<SmallKernels, kSmall> kKernels = Table(std::make_index_sequence<kSmall>{});

}  // namespace

const SmallKernels& SmallKernelsFor(int n) { return kKernels[static_cast<std::size_t>(n - 1)]; }

}  // namespace alidade::internal
