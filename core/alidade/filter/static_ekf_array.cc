// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/static_ekf_array.h"

#include "alidade/base/error.h"
#include "alidade/state/vector_kernels.h"

namespace alidade::internal {
namespace {

/// Of the kernels, the slowest first.
constexpr int kLaneCounts[] = {2, 4, 16};

}  // namespace

int BestLanes() {
  const std::span<const VectorKernels> all = AllVectorKernels();
  const std::string_view best = BestVectorKernels().name;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].name == best) return kLaneCounts[i];
  }
  return kLaneCounts[0];
}

bool HasLanes(int lanes) {
  const auto* const end = kLaneCounts + AllVectorKernels().size();
  return std::find(kLaneCounts, end, lanes) != end;
}

}  // namespace alidade::internal
