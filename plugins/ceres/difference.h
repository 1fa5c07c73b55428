// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "alidade/model/autodiff.h"
#include "alidade/model/jet.h"

namespace alidade::ceres_batch {

/// Computes d = z (-) h and, if j is not null, dd/dh (row-major) in the tangent at h.
template <class G>
void Difference(const double* z, const double* h, double* d, double* j) {
  using Jet = alidade::Jet<double, G::kTangent>;
  Jet h_jet[G::kAmbient], difference[G::kTangent];
  alidade::detail::LiftBlock<G>(h, 0, h_jet);
  G::Minus(z, h_jet, difference);
  for (int i = 0; i < G::kTangent; ++i) {
    d[i] = difference[i].a;
    if (j != nullptr) std::copy_n(difference[i].v, G::kTangent, j + i * G::kTangent);
  }
}

}  // namespace alidade::ceres_batch
