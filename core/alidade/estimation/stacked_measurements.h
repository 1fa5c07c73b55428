// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "alidade/estimation/pending_measurements.h"

/// The measurements of an update stacked: m rows in all, n = size of P.
namespace alidade::internal {

/// m.
int TotalDof(std::span<PendingMeasurement* const> rows);

/// Whether the gain is reported: not for sensors of landmarks, whose blocks come and go.
inline bool GainIsRecorded(const PendingMeasurement& pending) {
  return !pending.place->has_landmark;
}
/// Writes the columns of K to the reports, by copy(rows of P, column, count, destination).
template <class Copy>
void RecordGainBy(const FilterState& f, std::span<PendingMeasurement* const> rows,
                  const Copy& copy) {
  const std::vector<int>& kept = f.blocks.gain_rows;
  int column = 0;
  for (PendingMeasurement* const pending : rows) {
    const int m = pending->place->dof;
    if (GainIsRecorded(*pending)) {
      const std::size_t count = kept.size() * static_cast<std::size_t>(m);
      if (pending->gain.size() < count) pending->gain.resize(count);
      pending->report->gain = {pending->gain.data(), count};
      copy(kept, column, m, pending->gain.data());
    }
    column += m;
  }
}
/// Writes the columns of K, a matrix, to the reports.
void RecordGain(const FilterState& f, std::span<PendingMeasurement* const> rows,
                const ConstMatrix& gain);

struct Stacked {
  Workspace::Matrix h, noise;    ///< H (m x n), R (m x m)
  Workspace::Vector innovation;  ///< m
};

/// H, R and the innovation stacked, in f.work.
Stacked Stack(FilterState& f, std::span<PendingMeasurement* const> rows);
/// Each of them by itself, in f.work.
Workspace::Matrix JacobianOf(FilterState& f, std::span<PendingMeasurement* const> rows);
Workspace::Matrix NoiseOf(FilterState& f, std::span<PendingMeasurement* const> rows);
Workspace::Vector InnovationOf(FilterState& f, std::span<PendingMeasurement* const> rows);
/// Calls zero(offset, size, at, k) for each part of the gain that is zero because of a consider
/// block or role: rows [offset, offset + size) of P, columns [at, at + k) of the update.
template <class Zero>
void ForEachConsidered(const FilterState& f, std::span<PendingMeasurement* const> rows,
                       const Zero& zero) {
  for (std::size_t i = 0;
       f.blocks.considering && i < f.problem_index->problem.layout.blocks().size(); ++i) {
    const Block& block = f.state.layout()[static_cast<BlockId>(i)];
    if (!block.present || block.status != BlockStatus::kConsider) continue;
    zero(block.tangent_offset, block.geometry().tangent, 0, TotalDof(rows));
  }
  int at = 0;
  for (const PendingMeasurement* pending : rows) {
    const SensorPlace& place = *pending->place;
    for (std::size_t i = 0; place.considers && i < place.parts.size(); ++i) {
      if (place.consider[i])
        zero(place.parts[i].offset, place.parts[i].size, at, pending->report->dof);
    }
    at += pending->report->dof;
  }
}

}  // namespace alidade::internal
