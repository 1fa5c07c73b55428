// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "alidade/filter/filter_state.h"
#include "alidade/state/panels.h"

/// The rows of an update as whole matrices, m rows in all, n = size of P: what methods share.
namespace alidade::internal {

/// Rows below one another.
struct Stacked {
  Workspace::Matrix h, noise;    ///< H (m x n), R (m x m)
  Workspace::Vector innovation;  ///< m
};

/// The rows as they are, in f.work.
Stacked Stack(FilterState& f, std::span<Row* const> rows);
/// H, R, the innovation and P H' (n x m, as the kernels take it) of all rows, in f.work.
Workspace::Matrix JacobianOf(FilterState& f, std::span<Row* const> rows);
Workspace::Matrix NoiseOf(FilterState& f, std::span<Row* const> rows);
Workspace::Vector InnovationOf(FilterState& f, std::span<Row* const> rows);
Panels ProjectionOf(FilterState& f, std::span<Row* const> rows);
/// (H Phi)' of all rows, k x m, in f.work: see Covariance.
Workspace::Matrix OutsideOf(FilterState& f, std::span<Row* const> rows);
/// The lower triangle of s += H P H', m x m, from the P H' that ProjectionOf returned last.
void AddProjected(const FilterState& f, const Panels& pht, Workspace::Matrix& s);
/// Calls zero(offset, size, at, k) for each part of the gain that consider blocks and roles keep at
/// 0: rows [offset, offset + size) of P, columns [at, at + k) of the update.
template <class Zero>
void ForEachConsidered(const FilterState& f, std::span<Row* const> rows, const Zero& zero) {
  for (std::size_t i = 0; f.blocks.considering && i < f.binding->system.layout.blocks().size();
       ++i) {
    const Block& block = f.state.layout()[static_cast<BlockId>(i)];
    if (!block.present || block.status != BlockStatus::kConsider) continue;
    zero(block.tangent_offset, block.geometry().tangent, 0, CountOf(rows));
  }
  Eigen::Index at = 0;
  for (const Row* row : rows) {
    const SensorPlace& place = *row->place;
    for (std::size_t i = 0; i < place.parts.size(); ++i) {
      if (place.consider[i]) zero(place.parts[i].offset, place.parts[i].size, at, row->report->dof);
    }
    at += row->report->dof;
  }
}
/// J (n x n, in f.work) of State::MoveTo(values): dx there = J dx here.
Workspace::Matrix TransportTo(FilterState& f, const std::vector<double>& values);

}  // namespace alidade::internal
