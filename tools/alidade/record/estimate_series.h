// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "alidade/estimation/problem.h"
#include "alidade/state/state.h"

/// Estimates of a whole run, for comparison with those of another estimator.
namespace alidade::internal {

/// Block of a series; `name` is `owner.block`.
struct SeriesBlock {
  std::string name, unit;
  Geometry geometry;
  bool constant = false;  ///< the block has no covariance

  std::string owner() const { return name.substr(0, name.find('.')); }
};

/// Returns the initial blocks of a problem.
std::vector<SeriesBlock> SeriesBlocksOf(const Problem& problem);

/// Appends the lower triangle of P of the first `blocks` blocks to `cells`, row by row. Elements of
/// blocks without covariance are NaN.
void AppendCovariance(const State& state, std::size_t blocks, std::vector<double>& cells);

/// Estimates of one estimator by timestamp. N is the sum of ambient sizes, n of tangent sizes.
struct Series {
  /// With more tangent elements, a series contains variances only, to limit its size.
  static constexpr int kMaxJoint = 64;

  std::vector<SeriesBlock> blocks;
  std::vector<Timestamp> timestamps;
  std::vector<double> values;  ///< N for each timestamp; NaN if a block has no value
  /// For each timestamp, the lower triangle of P row by row if `joint`, else its diagonal. Elements
  /// of blocks without covariance are NaN.
  std::vector<double> covariances;
  bool joint = true;

  int ambient() const;
  int tangent() const;
  /// Returns how many numbers of `covariances` belong to a timestamp.
  std::size_t cells() const;
  /// Returns P of the `size` tangent elements that start at `first`, at timestamp index `row`. It
  /// is diagonal if not `joint`.
  Eigen::MatrixXd Covariance(std::size_t row, int first, int size) const;
  void Append(Timestamp timestamp, const State& state);
};

}  // namespace alidade::internal
