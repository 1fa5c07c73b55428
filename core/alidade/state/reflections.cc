// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/reflections.h"

#include <cmath>

#include "alidade/state/vector_kernels.h"

namespace alidade::internal {

void Reflect(Workspace::Matrix& a, double* pivot, Eigen::Index first, const double* v) {
  BestVectorKernels().reflect(a.rows(), a.cols() - first, v, pivot, a.data() + first * a.rows(),
                              a.rows());
}

void EliminateRow(Workspace::Matrix& a, Eigen::Index k, Eigen::Index first, double* v) {
  const Eigen::Index count = a.cols() - first;
  double squared = 0.0;
  for (Eigen::Index j = 0; j < count; ++j) {
    v[j + 1] = a(k, first + j);
    squared += v[j + 1] * v[j + 1];
  }
  v[0] = 0.0;
  if (squared == 0.0) return;
  const double pivot = a(k, k), norm = std::sqrt(pivot * pivot + squared);
  const double scale = 1.0 / std::sqrt(norm * (norm + std::abs(pivot)));
  v[0] = std::copysign(norm + std::abs(pivot), pivot) * scale;
  for (Eigen::Index j = 1; j <= count; ++j) v[j] *= scale;
  Reflect(a, a.col(k).data(), first, v);
  a(k, k) = -std::copysign(norm, pivot);
  a.row(k).tail(count).setZero();
}

void Triangularise(Workspace::Matrix& a, Workspace::Matrix& reflectors) {
  for (Eigen::Index k = 0; k < reflectors.cols(); ++k) {
    EliminateRow(a, k, k + 1, &reflectors(k, k));
  }
}

}  // namespace alidade::internal
