// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "alidade/filter/filter_state.h"

namespace alidade::internal {

/// What Kalman filters differ in: how x and P are stepped, what a measurement is expected to be,
/// and how x and P are corrected by it. Knows nothing of gates, frames or landmarks.
class Method {
 public:
  virtual ~Method() = default;
  /// With all that it carries besides x and P.
  virtual std::unique_ptr<Method> Clone() const = 0;

  /// Takes over x and P as they are at the start.
  virtual void Begin(FilterState& /*f*/) {}
  /// Moves x and P by dt_s: all of it or nothing, and why.
  virtual Trouble Step(FilterState& f, double dt_s) = 0;
  /// h, the innovation, R and S of a row by itself, and what Correct needs besides; kAccepted, or
  /// why they cannot be had, which it notes.
  virtual Outcome Predict(FilterState& f, Row& row) = 0;
  /// One update with all rows, as Predict left them, R and S weighed since: all of it happens, or
  /// nothing. kAccepted, and FilterState::RecordUpdate has been called, which keeps the gain and
  /// the last measurement used; or why not, which it notes but for kNotPd and kNotFinite. A row
  /// that is the reason may have an outcome of its own, in its report.
  virtual Outcome Correct(FilterState& f, std::span<Row* const> rows) = 0;
};

// What methods share: the rows of an update as whole matrices, m rows in all, n = size of P.

/// Rows below one another.
struct Stacked {
  Workspace::Matrix h, noise;    ///< H (m x n), R (m x m)
  Workspace::Vector innovation;  ///< m
};

/// m
Eigen::Index CountOf(std::span<Row* const> rows);
/// The rows as they are, in f.work.
Stacked Stack(FilterState& f, std::span<Row* const> rows);
/// P H' of all rows, n x m, in f.work.
Workspace::Matrix ProjectionOf(FilterState& f, std::span<Row* const> rows);
/// s += H P H' of all rows, m x m, from P H'.
void AddProjected(std::span<Row* const> rows, const Workspace::Matrix& pht, Workspace::Matrix& s);
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
