// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>

#include "alidade/experiment/similarity.h"
#include "alidade/record/estimate_series.h"

namespace alidade::internal {

/// Distance between the estimates of a series and of a reference at the common timestamps. The
/// difference is d = x (-) x_ref, in the tangent space at the reference.
struct Distance {
  std::map<std::string, double> rms;    ///< sqrt(mean |d|^2) of each block
  std::map<std::string, double> final;  ///< |d| of each block at the last timestamp
  /// sqrt(mean d' P_ref^-1 d / dof) of each owner, in standard deviations of the reference.
  /// Timestamps with a singular P_ref are skipped.
  std::map<std::string, double> sigmas;
  std::map<std::string, double> final_sigmas;  ///< the same ratio at the last timestamp
};

/// Computes the distance between two series. Two blocks correspond if they have the same name and
/// geometry.
Distance DistanceBetween(const Series& series, const Series& reference);

/// Aligns the trajectories of a block in two series. Returns nullopt if the block is not a vector
/// of three elements, or if the points do not determine a similarity.
std::optional<SimilarityFit> AlignTrajectories(const Series& series, const Series& reference,
                                               const std::string& block);

}  // namespace alidade::internal
