// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "alidade/estimation/pending_measurements.h"

/// Stacked matrices of the measurements of an update. m: total tangent size of the measurements, n:
/// size of P.
namespace alidade::internal {

/// Returns m.
int TotalDof(std::span<PendingMeasurement* const> rows);

/// Returns whether the gain of a measurement is reported. The gain is not reported for measurements
/// of landmarks, because the blocks of landmarks are added and removed during a run.
inline bool GainIsRecorded(const PendingMeasurement& pending) {
  return !pending.place->has_landmark;
}
/// Writes the columns of K to the reports of the measurements. Calls copy(rows of P, column, count,
/// destination) for each measurement.
template <class Copy>
void RecordGainBy(const FilterState& f, std::span<PendingMeasurement* const> rows,
                  const Copy& copy) {
  const std::vector<int>& p_rows = f.blocks.gain_rows;
  int column = 0;
  for (PendingMeasurement* const pending : rows) {
    const int m = pending->place->dof;
    if (GainIsRecorded(*pending)) {
      const std::size_t count = p_rows.size() * static_cast<std::size_t>(m);
      if (pending->gain.size() < count) pending->gain.resize(count);
      pending->report->gain = {pending->gain.data(), count};
      copy(p_rows, column, m, pending->gain.data());
    }
    column += m;
  }
}
/// Writes the columns of the matrix K to the reports of the measurements.
void RecordGain(const FilterState& f, std::span<PendingMeasurement* const> rows,
                const ConstMatrix& gain);

/// Matrices of all measurements of an update.
struct StackedMeasurements {
  Workspace::Matrix h, noise;    ///< H (m x n), R (m x m)
  Workspace::Vector innovation;  ///< stacked innovations, size m
};

/// Returns the stacked H, R and innovation, stored in f.work.
StackedMeasurements Stack(FilterState& f, std::span<PendingMeasurement* const> rows);
/// The next three functions return the stacked H, the stacked R, and the stacked innovation. They
/// store the results in f.work.
Workspace::Matrix JacobianOf(FilterState& f, std::span<PendingMeasurement* const> rows);
Workspace::Matrix NoiseOf(FilterState& f, std::span<PendingMeasurement* const> rows);
Workspace::Vector InnovationOf(FilterState& f, std::span<PendingMeasurement* const> rows);
/// Calls zero(offset, size, column, count) for each part of the gain that is zero because a block
/// or role is a consider state. The part consists of the rows [offset, offset + size) of P and the
/// columns [column, column + count) of the update.
template <class Zero>
void ForEachConsidered(const FilterState& f, std::span<PendingMeasurement* const> rows,
                       const Zero& zero) {
  for (std::size_t i = 0;
       f.blocks.has_consider && i < f.problem_index->problem.layout.blocks().size(); ++i) {
    const Block& block = f.state.layout()[static_cast<BlockId>(i)];
    if (!block.present || block.status != BlockStatus::kConsider) continue;
    zero(block.tangent_offset, block.geometry().tangent, 0, TotalDof(rows));
  }
  int column = 0;
  for (const PendingMeasurement* pending : rows) {
    const SensorPlace& place = *pending->place;
    for (std::size_t i = 0; place.has_consider && i < place.parts.size(); ++i) {
      if (place.is_consider[i])
        zero(place.parts[i].offset, place.parts[i].size, column, pending->report->dof);
    }
    column += pending->report->dof;
  }
}

}  // namespace alidade::internal
