// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/autodiff.h"

namespace alidade::ceres_batch {

/// d = z (-) h and, where j is not null, dd/dh (row-major) in the tangent at h.
template <class G>
// NOLINTNEXTLINE(readability-non-const-parameter): written to below
void Difference(const double* z, const double* h, double* d, double* j) {
  using Jet = ceres::Jet<double, G::kTangent>;
  Jet moved[G::kAmbient], difference[G::kTangent];
  alidade::detail::LiftOne<G>(h, 0, moved);
  G::Minus(z, moved, difference);
  for (int i = 0; i < G::kTangent; ++i) {
    d[i] = difference[i].a;
    for (int k = 0; j != nullptr && k < G::kTangent; ++k)
      j[i * G::kTangent + k] = difference[i].v[k];
  }
}

}  // namespace alidade::ceres_batch
