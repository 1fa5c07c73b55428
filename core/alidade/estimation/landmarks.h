// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "alidade/base/timestamp.h"
#include "alidade/estimation/landmark_representation.h"
#include "alidade/state/eigen_alignment.h"

/// Landmarks: state blocks that are added and removed during a run.
namespace alidade {

/// Landmark whose position in the world is known beforehand, m. Its representation is xyz.
struct KnownLandmark {
  std::int64_t id = 0;
  std::array<double, 3> position{};
  double sigma = 0.0;  ///< of each element; 0: known exactly, never corrected
};

/// Options for the initialisation, conversion and pruning of landmarks.
struct LandmarkOptions {
  /// Inverse distance, 1/m, and its standard deviation, which one observation does not determine.
  /// They depend on the scene and have no default.
  struct Prior {
    double inverse_distance = std::numeric_limits<double>::quiet_NaN();
    double sigma = std::numeric_limits<double>::quiet_NaN();
    /// If a frame measures at least this number of converged landmarks, the median of their inverse
    /// distances replaces `inverse_distance`; 0: never.
    int adapt_after = 0;
    /// Replaces `min_observations` below for landmarks that need this prior; 0: no replacement.
    int min_observations = 0;
  };
  enum class NegativeDepth { kKeep, kDelete };

  static constexpr int kUnlimited = std::numeric_limits<int>::max();

  std::optional<Prior> prior;
  /// New landmarks are initialised as long as a frame measures fewer landmarks than this.
  int max_per_frame = kUnlimited;
  int min_observations = 1;   ///< the observation with this number initialises a landmark
  int max_missed_frames = 0;  ///< frames without an observation until it is deleted; 0: never
  /// A landmark is deleted if it has at least `min_attempts` measurements and the share of accepted
  /// ones is below this.
  double min_match_ratio = 0.0;
  int min_attempts = 10;
  /// A landmark is converted to xyz if its linearity index [Civera2008] is below this; 0: never.
  double max_linearity_index = 0.0;
  /// Reaction to an inverse distance at or below zero after an update.
  NegativeDepth negative_depth = NegativeDepth::kKeep;
  std::vector<KnownLandmark> known;
};

/// Options of one-point RANSAC [Civera2010], the outlier rejection for landmarks. A hypothesis is
/// the state after an update by one match. The matches that it predicts to within pixel noise are
/// its support. The support of the best hypothesis is used for an update. The remaining matches
/// that are consistent with the updated state are used for a second update.
struct OnePointRansac {
  /// Probability that an inlier is within its own noise.
  double inlier_probability = 0.99;
  /// Probability that at least one of the tried matches is an inlier.
  double confidence = 0.99;
  /// Probability that an inlier outside the support is used by the second update.
  double rescue_probability = 0.99;
};

/// Estimate of a landmark in the state, or its last estimate before it was removed.
struct LandmarkEstimate {
  std::int64_t id = 0;
  int generation = 0;  ///< number of earlier landmarks with this id
  std::optional<LandmarkRepresentation> representation;
  Eigen::Vector3d position = Eigen::Vector3d::Constant(std::nan(""));       ///< in the world, m
  Eigen::Vector3d true_position = Eigen::Vector3d::Constant(std::nan(""));  ///< m; NaN: unknown
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Constant(std::nan(""));
  double inverse_distance = std::nan("");  ///< 1/m; NaN for xyz
  double sigma = std::nan("");             ///< of the inverse distance, 1/m
  Timestamp first = kNoTimestamp, last = kNoTimestamp;
  Timestamp removed = kNoTimestamp;  ///< of its removal; kNoTimestamp: it is in the state
  int tried = 0, accepted = 0;       ///< measurements
};

/// Counts of landmark events in one frame, or in all frames.
struct LandmarkCounts {
  int initialised = 0, deleted = 0, converted = 0;
  int negative = 0;    ///< landmarks whose inverse distance fell to zero or below
  int hypotheses = 0;  ///< matches that RANSAC tried
  int rescued = 0;     ///< matches outside the support that were used afterwards
};

}  // namespace alidade
