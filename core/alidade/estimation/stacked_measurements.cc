// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/stacked_measurements.h"

#include <algorithm>

namespace alidade::internal {
namespace {

/// Calls visit(measurement, offset) for each measurement. `offset` is the first row of the
/// measurement.
template <class Visit>
void ForEachOffset(std::span<PendingMeasurement* const> rows, const Visit& visit) {
  Eigen::Index offset = 0;
  for (const PendingMeasurement* pending : rows) {
    visit(*pending, offset);
    offset += pending->report->dof;
  }
}

}  // namespace

void RecordGain(const FilterState& f, std::span<PendingMeasurement* const> rows,
                const ConstMatrix& gain) {
  RecordGainBy(f, rows,
               [&](std::span<const int> p_rows, int column, int count, double* destination) {
                 for (int j = column; j < column + count; ++j) {
                   for (const int i : p_rows) *destination++ = gain(i, j);
                 }
               });
}

int TotalDof(std::span<PendingMeasurement* const> rows) {
  int m = 0;
  for (const PendingMeasurement* pending : rows) m += pending->report->dof;
  return m;
}

StackedMeasurements Stack(FilterState& f, std::span<PendingMeasurement* const> rows) {
  return {JacobianOf(f, rows), NoiseOf(f, rows), InnovationOf(f, rows)};
}

Workspace::Matrix JacobianOf(FilterState& f, std::span<PendingMeasurement* const> rows) {
  Workspace::Matrix h = f.work.Take(TotalDof(rows), f.size());
  h.setZero();
  ForEachOffset(rows, [&](const PendingMeasurement& pending, Eigen::Index offset) {
    const JacobianRows& jacobian = pending.linearised.h;
    const Eigen::Map<const RowMajor> compact(jacobian.data, jacobian.rows, jacobian.width());
    for (int c = 0; c < jacobian.width(); ++c) {
      h.col(jacobian.columns[static_cast<std::size_t>(c)]).segment(offset, jacobian.rows) +=
          compact.col(c);
    }
  });
  return h;
}

Workspace::Matrix NoiseOf(FilterState& f, std::span<PendingMeasurement* const> rows) {
  Workspace::Matrix noise = f.work.Take(TotalDof(rows), TotalDof(rows));
  noise.setZero();
  ForEachOffset(rows, [&](const PendingMeasurement& pending, Eigen::Index offset) {
    const Eigen::Index k = pending.report->dof;
    noise.block(offset, offset, k, k) = Eigen::Map<const RowMajor>(pending.R.data(), k, k);
  });
  return noise;
}

Workspace::Vector InnovationOf(FilterState& f, std::span<PendingMeasurement* const> rows) {
  Workspace::Vector innovation = f.work.Take(TotalDof(rows));
  ForEachOffset(rows, [&](const PendingMeasurement& pending, Eigen::Index offset) {
    std::ranges::copy(pending.report->innovation, innovation.data() + offset);
  });
  return innovation;
}

}  // namespace alidade::internal
