// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "alidade/state.h"
#include "alidade/system.h"
#include "path_alignment.h"

/// The estimates of a whole run, to be compared with those of another estimator.
namespace alidade::internal {

/// A block of a series; `name` is `owner.block`.
struct SeriesBlock {
  std::string name, unit;
  Geometry geometry;
  bool fixed = false;  ///< it has no covariance

  std::string owner() const { return name.substr(0, name.find('.')); }
};

/// The blocks that a system has from the start.
std::vector<SeriesBlock> SeriesBlocksOf(const System& system);

/// P of the first `blocks` blocks as its lower triangle, row by row, appended to `cells`; NaN where
/// a block has none.
void AppendCovariance(const State& state, std::size_t blocks, std::vector<double>& cells);

/// Estimates of one estimator by stamp. N = sum of the ambient sizes, n = of the tangent ones.
struct Series {
  /// More tangent elements than these have their variances alone: P of each frame is too much.
  static constexpr int kMostJoint = 64;

  std::vector<SeriesBlock> blocks;
  std::vector<Stamp> stamps;
  std::vector<double> values;  ///< N for each stamp; NaN where a block has no value
  /// For each stamp the lower triangle of P, row by row, where joint, else its diagonal; NaN where
  /// a block has none.
  std::vector<double> covariances;
  bool joint = true;

  int ambient() const;
  int tangent() const;
  /// How many numbers of `covariances` belong to a stamp.
  std::size_t cells() const;
  /// P of `size` tangent elements from `first` on, at row `row`; diagonal where not joint.
  Eigen::MatrixXd Covariance(std::size_t row, int first, int size) const;
  void Append(Stamp stamp, const State& state);
};

/// How far the estimates of one series are from those of a reference, over the stamps of both. With
/// d = x (-) x_ref in the tangent at the reference:
struct Distance {
  std::map<std::string, double> rms;    ///< by block: sqrt(mean |d|^2)
  std::map<std::string, double> final;  ///< by block: |d| at the last stamp
  /// By owner: sqrt(mean d' P_ref^-1 d / dof), in standard deviations of the reference; where P_ref
  /// is singular a stamp is left out.
  std::map<std::string, double> sigmas;
  std::map<std::string, double> final_sigmas;  ///< by owner, at the last stamp
};

/// Blocks are the same where name and geometry are.
Distance DistanceBetween(const Series& series, const Series& reference);

/// What the similarity that brings columns nearest to others leaves; nothing where FindSimilarity
/// finds none (similarity.h).
std::optional<Aligned> AlignBySimilarity(const Eigen::Matrix3Xd& points,
                                         const Eigen::Matrix3Xd& onto);
/// Of the paths that two series have of a vector block of three elements.
std::optional<Aligned> AlignPaths(const Series& series, const Series& reference,
                                  const std::string& block);

}  // namespace alidade::internal
