// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "alidade/estimation/problem.h"
#include "alidade/state/state.h"

/// The estimates of a whole run, to be compared with those of another estimator.
namespace alidade::internal {

/// A block of a series; `name` is `owner.block`.
struct SeriesBlock {
  std::string name, unit;
  Geometry geometry;
  bool constant = false;  ///< it has no covariance

  std::string owner() const { return name.substr(0, name.find('.')); }
};

/// The blocks that a problem has from the start.
std::vector<SeriesBlock> SeriesBlocksOf(const Problem& problem);

/// P of the first `blocks` blocks as its lower triangle, row by row, appended to `cells`; NaN where
/// a block has none.
void AppendCovariance(const State& state, std::size_t blocks, std::vector<double>& cells);

/// Estimates of one estimator by timestamp. N = sum of the ambient sizes, n = of the tangent ones.
struct Series {
  /// More tangent elements than these have their variances alone: P of each frame is too much.
  static constexpr int kMostJoint = 64;

  std::vector<SeriesBlock> blocks;
  std::vector<Timestamp> timestamps;
  std::vector<double> values;  ///< N for each timestamp; NaN where a block has no value
  /// For each timestamp the lower triangle of P, row by row, where joint, else its diagonal; NaN
  /// where a block has none.
  std::vector<double> covariances;
  bool joint = true;

  int ambient() const;
  int tangent() const;
  /// How many numbers of `covariances` belong to a timestamp.
  std::size_t cells() const;
  /// P of `size` tangent elements from `first` on, at row `row`; diagonal where not joint.
  Eigen::MatrixXd Covariance(std::size_t row, int first, int size) const;
  void Append(Timestamp timestamp, const State& state);
};

}  // namespace alidade::internal
