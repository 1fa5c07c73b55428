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

/// Landmarks: the part of the state that comes and goes with what is seen.
namespace alidade {

/// A landmark whose place in the world is known beforehand, m. It starts as xyz.
struct KnownLandmark {
  std::int64_t id = 0;
  std::array<double, 3> position{};
  double sigma = 0.0;  ///< of each element; 0: known exactly, never corrected
};

/// How landmarks are initialised, converted and pruned.
struct LandmarkOptions {
  /// What one observation does not determine: the inverse distance, 1/m, and its standard
  /// deviation. Neither has a default: they depend on the scene.
  struct Prior {
    double inverse_distance = std::numeric_limits<double>::quiet_NaN();
    double sigma = std::numeric_limits<double>::quiet_NaN();
    /// Once so many landmarks that a frame measures have converged, the median of their inverse
    /// distances stands for `inverse_distance`; 0: never.
    int adapt_after = 0;
    /// As `min_observations` below, of landmarks that take this prior; 0: that one.
    int min_observations = 0;
  };
  enum class NegativeDepth { kKeep, kDelete };

  static constexpr int kUnlimited = std::numeric_limits<int>::max();

  std::optional<Prior> prior;
  int max_per_frame =
      kUnlimited;  ///< landmarks measured in a frame, below which new ones are initialised
  int min_observations = 1;   ///< observations, the last of which initialises it
  int max_missed_frames = 0;  ///< after so many without an observation it is deleted; 0: never
  /// It is deleted where a smaller share of at least `min_attempts` measurements is accepted.
  double min_match_ratio = 0.0;
  int min_attempts = 10;
  /// It becomes xyz once its index of linearity [Civera2008] is below this; 0: never.
  double max_linearity_index = 0.0;
  /// What is done where an update leaves an inverse distance at or below zero.
  NegativeDepth negative_depth = NegativeDepth::kKeep;
  std::vector<KnownLandmark> known;
};

/// Matches of landmarks that agree, found by 1-point RANSAC [Civera2010]: one match alone corrects
/// the state, and those that it then predicts to within pixel noise support it. The matches of the
/// best support make an update; of the rest, those join that fit the state that it leaves.
struct OnePointRansac {
  double inlier_probability =
      0.99;                  ///< probability with which a match that agrees is within its own noise
  double confidence = 0.99;  ///< of having tried one match that is right, when no more are tried
  double rescue_probability =
      0.99;  ///< probability with which a match that fits joins after the update
};

/// A landmark in the state, or as it was when it was removed; for the record.
struct LandmarkEstimate {
  std::int64_t id = 0;
  int generation = 0;  ///< landmarks of this id before it
  std::optional<LandmarkRepresentation> representation;
  Eigen::Vector3d position = Eigen::Vector3d::Constant(std::nan(""));       ///< in the world, m
  Eigen::Vector3d true_position = Eigen::Vector3d::Constant(std::nan(""));  ///< where known, m
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Constant(std::nan(""));
  double inverse_distance = std::nan("");  ///< 1/m; not of xyz
  double sigma = std::nan("");             ///< of the inverse distance, 1/m
  Timestamp first = kNoTimestamp, last = kNoTimestamp;
  Timestamp removed = kNoTimestamp;  ///< when it was; none: it is in the state
  int tried = 0, accepted = 0;       ///< measurements
};

/// What became of landmarks in one frame, or in all.
struct LandmarkCounts {
  int initialised = 0, deleted = 0, converted = 0;
  int negative = 0;    ///< their inverse distance fell to zero or below
  int hypotheses = 0;  ///< matches that RANSAC tried
  int rescued = 0;     ///< matches outside the support that joined afterwards
};

}  // namespace alidade
