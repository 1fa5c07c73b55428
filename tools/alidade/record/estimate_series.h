// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "alidade/estimation/problem.h"
#include "alidade/state/state.h"

/// Estimates of one estimator over a whole run, for comparison with another estimator.
namespace alidade::internal {

/// Block of a series; `name` is `owner.block`.
struct SeriesBlock {
  std::string name, unit;
  Geometry geometry;
  bool constant = false;  ///< true: the block has no covariance

  std::string owner() const { return name.substr(0, name.find('.')); }
};

/// Returns the blocks of the initial state of a problem.
std::vector<SeriesBlock> SeriesBlocksOf(const Problem& problem);

/// Appends the covariance of the first `blocks` blocks to `cells`: its lower triangle, row by row.
/// Elements of blocks without covariance are NaN.
void AppendCovariance(const State& state, std::size_t blocks, std::vector<double>& cells);

/// Estimates of one estimator at each timestamp. N is the sum of the ambient sizes of all blocks.
struct Series {
  /// Maximum number of tangent elements for which a series contains the joint covariance. A larger
  /// series contains only variances, which limits its memory.
  static constexpr int kMaxJoint = 64;

  std::vector<SeriesBlock> blocks;
  std::vector<Timestamp> timestamps;
  std::vector<double> values;  ///< N numbers for each timestamp; NaN if a block has no value
  /// Covariances at each timestamp. If `joint` is true, these are the lower triangle of P, row by
  /// row. Otherwise they are the diagonal of P. Elements of blocks without covariance are NaN.
  std::vector<double> covariances;
  bool joint = true;

  int ambient() const;
  int tangent() const;
  /// Returns the number of elements of `covariances` for each timestamp.
  std::size_t cells() const;
  /// Returns the covariance of the `size` tangent elements from element `first` on, at the
  /// timestamp with index `row`. The result is diagonal unless `joint` is true.
  Eigen::MatrixXd Covariance(std::size_t row, int first, int size) const;
  void Append(Timestamp timestamp, const State& state);
};

}  // namespace alidade::internal
