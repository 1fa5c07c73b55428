// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>

#include "alidade/experiment/similarity.h"
#include "alidade/record/estimate_series.h"

namespace alidade::internal {

/// Distance of the estimates of one series from those of a reference, over their common timestamps,
/// with d = x (-) x_ref in the tangent space at the reference.
struct Distance {
  std::map<std::string, double> rms;    ///< by block: sqrt(mean |d|^2)
  std::map<std::string, double> final;  ///< by block: |d| at the last timestamp
  /// By owner: sqrt(mean d' P_ref^-1 d / dof), in standard deviations of the reference. Timestamps
  /// with a singular P_ref are skipped.
  std::map<std::string, double> sigmas;
  std::map<std::string, double> final_sigmas;  ///< by owner, at the last timestamp
};

/// Computes the distance of two series. Blocks correspond if their name and geometry are equal.
Distance DistanceBetween(const Series& series, const Series& reference);

/// Aligns the trajectories of a vector block of three elements in two series. Returns nullopt if
/// there is no such block, or the points do not determine a similarity.
std::optional<SimilarityFit> AlignTrajectories(const Series& series, const Series& reference,
                                               const std::string& block);

}  // namespace alidade::internal
