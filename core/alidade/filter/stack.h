// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "alidade/filter/filter_state.h"

/// The rows of an update as whole matrices: m rows in all, n = size of P.
namespace alidade::internal {

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
/// Zeroes the gain (n x m) of consider blocks and roles; K - K* of what it was before, empty where
/// nothing changed.
Eigen::MatrixXd MaskConsidered(const FilterState& f, std::span<Row* const> rows,
                               Eigen::MatrixXd& gain);
/// J (n x n, in f.work) of State::MoveTo(values): dx there = J dx here.
Workspace::Matrix TransportTo(FilterState& f, const std::vector<double>& values);

}  // namespace alidade::internal
