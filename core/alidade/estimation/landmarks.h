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

/// Landmark whose position in the world, in m, is known before the run. The representation is xyz.
struct KnownLandmark {
  std::int64_t id = 0;
  std::array<double, 3> position{};
  double sigma = 0.0;  ///< standard deviation of each element, m; 0: exact, never corrected
};

/// Options for the initialisation, conversion and pruning of landmarks.
struct LandmarkOptions {
  /// Prior of the inverse distance of a landmark, in 1/m. One observation does not determine the
  /// inverse distance. The mean and standard deviation depend on the scene and have no default.
  struct Prior {
    double inverse_distance = std::numeric_limits<double>::quiet_NaN();
    double sigma = std::numeric_limits<double>::quiet_NaN();
    /// If a frame measures at least this number of converged landmarks, their median inverse
    /// distance replaces `inverse_distance`. 0: never.
    int adapt_after = 0;
    /// Replaces LandmarkOptions::min_observations for landmarks that need this prior. 0: no
    /// replacement.
    int min_observations = 0;
  };
  enum class NegativeDepth { kKeep, kDelete };

  static constexpr int kUnlimited = std::numeric_limits<int>::max();

  std::optional<Prior> prior;
  /// A frame does not initialise further landmarks if it measures this number of landmarks that are
  /// in the state.
  int max_per_frame = kUnlimited;
  /// Number of observations that a landmark needs for its initialisation. 1: the first observation
  /// initialises the landmark.
  int min_observations = 1;
  /// A landmark is deleted after this number of frames without an observation. 0: never.
  int max_missed_frames = 0;
  /// A landmark with at least `min_attempts` measurements is deleted if less than this fraction of
  /// its measurements was accepted.
  double min_match_ratio = 0.0;
  int min_attempts = 10;
  /// A landmark is converted to xyz if its linearity index [Civera2008] is below this; 0: never.
  double max_linearity_index = 0.0;
  /// Reaction to an inverse distance at or below zero after an update.
  NegativeDepth negative_depth = NegativeDepth::kKeep;
  std::vector<KnownLandmark> known;
};

/// Options of one-point RANSAC [Civera2010], the outlier rejection for landmarks. A hypothesis is
/// the state after an update by one match. A match supports the hypothesis if its residual at this
/// state is within the measurement noise. The first update uses all matches that support the best
/// hypothesis. A second update uses the remaining matches that are consistent with the updated
/// state.
struct OnePointRansac {
  /// Probability that the residual of an inlier is within the threshold for the measurement noise.
  double inlier_probability = 0.99;
  /// Required probability that at least one of the tried matches is an inlier.
  double confidence = 0.99;
  /// Probability that the second update uses an inlier that does not support the best hypothesis.
  double rescue_probability = 0.99;
};

/// Estimate of a landmark in the state, or the last estimate of a removed landmark.
struct LandmarkEstimate {
  std::int64_t id = 0;
  int generation = 0;  ///< number of earlier landmarks with this id
  std::optional<LandmarkRepresentation> representation;
  Eigen::Vector3d position = Eigen::Vector3d::Constant(std::nan(""));  ///< in the world, m
  /// True position in the world, m; NaN: unknown.
  Eigen::Vector3d true_position = Eigen::Vector3d::Constant(std::nan(""));
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Constant(std::nan(""));
  double inverse_distance = std::nan("");  ///< 1/m; NaN for xyz
  double sigma = std::nan("");             ///< standard deviation of the inverse distance, 1/m
  Timestamp first = kNoTimestamp, last = kNoTimestamp;
  /// Time of the removal. kNoTimestamp: the landmark is in the state.
  Timestamp removed = kNoTimestamp;
  int tried = 0, accepted = 0;  ///< number of all measurements, and of accepted measurements
};

/// Counts of changes to landmarks in one frame, or in all frames.
struct LandmarkCounts {
  int initialised = 0, deleted = 0, converted = 0;
  int negative = 0;    ///< landmarks whose inverse distance fell to zero or below
  int hypotheses = 0;  ///< matches that RANSAC tried
  int rescued = 0;     ///< matches outside the support that the second update used
};

}  // namespace alidade
