// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>

#include "alidade/experiment/similarity.h"
#include "alidade/record/estimate_series.h"

namespace alidade::internal {

/// How far the estimates of one series are from those of a reference, over the timestamps of both.
/// With d = x (-) x_ref in the tangent at the reference:
struct Distance {
  std::map<std::string, double> rms;    ///< by block: sqrt(mean |d|^2)
  std::map<std::string, double> final;  ///< by block: |d| at the last timestamp
  /// By owner: sqrt(mean d' P_ref^-1 d / dof), in standard deviations of the reference; where P_ref
  /// is singular a timestamp is left out.
  std::map<std::string, double> sigmas;
  std::map<std::string, double> final_sigmas;  ///< by owner, at the last timestamp
};

/// Blocks are the same where name and geometry are.
Distance DistanceBetween(const Series& series, const Series& reference);

/// Of the trajectories that two series have of a vector block of three elements.
std::optional<SimilarityFit> AlignTrajectories(const Series& series, const Series& reference,
                                               const std::string& block);

}  // namespace alidade::internal
