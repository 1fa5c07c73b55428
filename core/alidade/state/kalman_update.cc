// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/kalman_update.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace alidade::internal {

void KalmanUpdate::Begin(Covariance& p, int capacity) {
  const SymmetricView view = p.view();
  const bool has_capacity = view.size == update_.p.size && view.stride == update_.p.stride &&
                            capacity <= update_.capacity && kernels_ != nullptr;
  update_.p = view;
  update_.m = 0;
  if (has_capacity) return;
  kernels_ = &KernelsFor(view);
  update_.panel_rows = kernels_->panel_rows;
  update_.capacity = capacity;
  Allocate();
}

/// Allocates memory for the size and capacity of the update.
void KalmanUpdate::Allocate() {
  const auto to_size = [](int count) { return static_cast<std::size_t>(count); };
  const std::size_t n = to_size(PaddedSize(update_.p.size)), c = to_size(update_.capacity),
                    m = to_size(PaddedSize(update_.capacity));
  const std::size_t needed = 2 * n * c + m * c + 2 * m + 2 * n;
  if (memory_.size() < needed) memory_.assign(std::max(needed, 2 * memory_.size()), 0.0);
  double* next = memory_.data();
  const auto allocate = [&](std::size_t count) { return std::exchange(next, next + count); };
  update_.w = allocate(n * c);
  gain_ = allocate(n * c);
  update_.s = allocate(m * c);
  update_.inverse_d = allocate(m);
  update_.y = allocate(m);
  update_.dx = allocate(n);
  update_.variance_decrease = allocate(n);
}

void KalmanUpdate::MoveColumns(int source, int destination, int count) {
  const int height = update_.panel_rows;
  for (int i = 0; i < update_.p.size; i += height) {
    double* const panel = &update_.At(update_.w, i, 0);
    std::copy_n(panel + std::ptrdiff_t{source} * height, std::ptrdiff_t{count} * height,
                panel + std::ptrdiff_t{destination} * height);
  }
}

Solution KalmanUpdate::Solve(std::span<const MeasurementRows* const> measurements,
                             bool needs_gain) {
  update_.measurements = measurements;
  update_.m = measurements.back()->column + measurements.back()->h.rows;
  update_.gain = needs_gain ? gain_ : nullptr;
  return Kernels::For(kernels_->solve, update_.m)(update_);
}

void KalmanUpdate::CopyGainOfPanels(std::span<const int> rows, int column, int count,
                                    double* destination) const {
  const std::ptrdiff_t height = update_.panel_rows;
  const double* first = update_.gain + column * height;
  for (const double* const end = first + count * height; first != end; first += height) {
    for (const int i : rows) {
      *destination++ =
          i < height ? first[i] : first[i / height * height * update_.capacity + i % height];
    }
  }
}

void KalmanUpdate::CopyColumns(int column, Eigen::Ref<Eigen::MatrixXd> destination) const {
  const Eigen::Index n = update_.p.size, height = update_.panel_rows;
  for (Eigen::Index i = 0; i < n; i += height) {
    const Eigen::Map<const Eigen::MatrixXd> panel(
        &update_.At(update_.w, static_cast<int>(i), column), height, destination.cols());
    const Eigen::Index count = std::min(height, n - i);
    destination.middleRows(i, count) = panel.topRows(count);
  }
}

void KalmanUpdate::CopyFactor(Eigen::Ref<Eigen::MatrixXd> l) const {
  const Eigen::Index m = update_.m, stride = PaddedSize(update_.m);
  for (Eigen::Index k = 0; k < m; ++k) {
    const double root = 1.0 / std::sqrt(update_.inverse_d[k]);
    l(k, k) = root;
    for (Eigen::Index i = k + 1; i < m; ++i) l(i, k) = root * update_.s[k * stride + i];
  }
}

}  // namespace alidade::internal
