// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/stacked_measurements.h"

#include <algorithm>

namespace alidade::internal {
namespace {

/// Calls take(row, at) for each row, `at` of the update's m where it begins.
template <class Take>
void ForEachPlace(std::span<PendingMeasurement* const> rows, const Take& take) {
  Eigen::Index at = 0;
  for (const PendingMeasurement* pending : rows) {
    take(*pending, at);
    at += pending->report->dof;
  }
}

}  // namespace

void RecordGain(const FilterState& f, std::span<PendingMeasurement* const> rows,
                const ConstMatrix& gain) {
  RecordGainBy(f, rows, [&](std::span<const int> kept, int column, int count, double* to) {
    for (int j = column; j < column + count; ++j) {
      for (const int i : kept) *to++ = gain(i, j);
    }
  });
}

int TotalDof(std::span<PendingMeasurement* const> rows) {
  int m = 0;
  for (const PendingMeasurement* pending : rows) m += pending->report->dof;
  return m;
}

Stacked Stack(FilterState& f, std::span<PendingMeasurement* const> rows) {
  return {JacobianOf(f, rows), NoiseOf(f, rows), InnovationOf(f, rows)};
}

Workspace::Matrix JacobianOf(FilterState& f, std::span<PendingMeasurement* const> rows) {
  Workspace::Matrix h = f.work.Take(TotalDof(rows), f.size());
  h.setZero();
  ForEachPlace(rows, [&](const PendingMeasurement& pending, Eigen::Index at) {
    const JacobianRows& own = pending.linearised.h;
    const Eigen::Map<const RowMajor> compact(own.data, own.rows, own.width());
    for (int c = 0; c < own.width(); ++c) {
      h.col(own.columns[static_cast<std::size_t>(c)]).segment(at, own.rows) += compact.col(c);
    }
  });
  return h;
}

Workspace::Matrix NoiseOf(FilterState& f, std::span<PendingMeasurement* const> rows) {
  Workspace::Matrix noise = f.work.Take(TotalDof(rows), TotalDof(rows));
  noise.setZero();
  ForEachPlace(rows, [&](const PendingMeasurement& pending, Eigen::Index at) {
    const Eigen::Index k = pending.report->dof;
    noise.block(at, at, k, k) = Eigen::Map<const RowMajor>(pending.R.data(), k, k);
  });
  return noise;
}

Workspace::Vector InnovationOf(FilterState& f, std::span<PendingMeasurement* const> rows) {
  Workspace::Vector innovation = f.work.Take(TotalDof(rows));
  ForEachPlace(rows, [&](const PendingMeasurement& pending, Eigen::Index at) {
    std::ranges::copy(pending.report->innovation, innovation.data() + at);
  });
  return innovation;
}

}  // namespace alidade::internal
