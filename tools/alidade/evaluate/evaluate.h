// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "alidade/evaluate/trajectory.h"
#include "alidade/experiment/similarity.h"
#include "alidade/state/eigen_alignment.h"

namespace alidade {

/// The transformation of the estimate that makes its positions fit the reference best, in the sense
/// of least squares [Umeyama1991], before errors are taken.
enum class Alignment {
  kNone,
  kScale,   ///< scale alone: what kSim3 finds, without its rotation and translation
  kOrigin,  ///< so that the first poses are the same
  kYaw,     ///< rotation about the world's z, and translation [Zhang2018]
  kSe3,     ///< rotation and translation
  kSim3,    ///< and scale
};
/// `none`, `scale`, `origin`, `yaw`, `se3`, `sim3`.
const char* ToString(Alignment alignment);

/// The trajectory in the world of the reference; covariances are dropped.
Trajectory operator*(const Similarity& reference_from_estimate, const Trajectory& estimate);

/// The transformation of `estimate` to `reference`, of the same poses in the same order, by the
/// first `poses` of them (0: all). Errors: kBadData where they are fewer than 3 for a rotation, and
/// for a scale all at one place or without anything in common.
Similarity Align(Alignment alignment, const Trajectory& reference, const Trajectory& estimate,
                 int poses = 0);

/// Pairs of poses (reference, estimate) of the same time.
struct Matches {
  std::vector<int> reference, estimate;
  int possible = 0;     ///< poses of the shorter trajectory
  bool by_row = false;  ///< without timestamps
};
/// To each pose of the shorter trajectory, the estimate if both are as long, the nearest of the
/// longer in time, the first of several, if it is within `max_diff`. `offset` is added to the
/// timestamps of the estimate. Several poses of the shorter may take the same one, as in evo. By
/// row if neither has timestamps, or both are of KITTI and one has none. Errors: kBadData if
/// nothing matches, if there are not as many rows, if only one has timestamps, if none holds the
/// offset.
Matches Associate(const Trajectory& reference, const Trajectory& estimate, Timestamp max_diff,
                  Timestamp offset);

/// What of the error pose E is taken [Sturm2012]: of E = est^-1 ref absolutely, and of
/// E = (ref_i^-1 ref_j)^-1 (est_i^-1 est_j) relatively. t its translation, R its rotation.
enum class PoseRelation {
  kTranslation,    ///< |t|, m
  kRotation,       ///< |R - I|, Frobenius
  kAngleDeg,       ///< angle of R, degrees
  kAngleRad,       ///< angle of R, rad
  kFull,           ///< |E - I|, Frobenius
  kPointDistance,  ///< |t|; relatively | |p_i - p_j|_ref - |p_i - p_j|_est |, m
};
/// `trans_part`, `rot_part`, `angle_deg`, `angle_rad`, `full`, `point_distance`.
const char* ToString(PoseRelation relation);
/// `m`, `deg`, `rad`, or "" of what has none.
const char* UnitOf(PoseRelation relation);

/// What the two poses of a relative error are apart: frames, metres of path, seconds, degrees and
/// rad of rotation.
enum class DeltaUnit { kFrames, kMetres, kSeconds, kDegrees, kRadians };
/// `f`, `m`, `s`, `d`, `r`.
const char* ToString(DeltaUnit unit);

/// Which pairs of poses a relative error is taken of.
struct PairOptions {
  double delta = 1.0;  ///< > 0; of frames a whole number
  DeltaUnit unit = DeltaUnit::kFrames;
  bool all = false;        ///< from each pose; else each pair begins where the one before ends
  double tolerance = 0.1;  ///< of all pairs, but of frames: how far off delta, as a share of it
};
/// Pairs (i, j), i < j, of the estimate. Each ends at the first pose that is at least delta after
/// its begin, along the path where metres, summed up where angles; metres begin, as in evo, at the
/// first pose that is delta after the first. Of all pairs j is the pose nearest to delta after i,
/// of angles each whose rotation from i fits. Error: kBadData where there are none.
std::vector<std::pair<int, int>> PairsOf(const Trajectory& estimate, const PairOptions& options);

/// Statistics of errors e: rmse = sqrt(mean e^2), std about the mean over n, sse = sum e^2.
struct ErrorStatistics {
  double rmse = 0.0, mean = 0.0, median = 0.0, std = 0.0, min = 0.0, max = 0.0, sse = 0.0;
};
/// Of at least one error.
ErrorStatistics StatisticsOf(std::vector<double> errors);

/// The errors of one relation, and what they come to.
struct PoseErrors {
  PoseRelation relation = PoseRelation::kTranslation;
  std::vector<double> errors;
  ErrorStatistics statistics;
};

/// Consistency of e with its covariance C over the poses where C is regular: e' C^-1 e / dof.
struct Nees {
  int poses = 0;
  double mean = 0.0;      ///< 1 is right
  double within95 = 0.0;  ///< share with e' C^-1 e <= chi2(0.95, dof); 0.95 is right
  int dof = 3;            ///< axes that are uncertain in one pose or more: 2 and 1 of a planar pose
};

/// Consistency of the accepted measurements of a sensor with what the filter predicted.
struct InnovationStatistics {
  std::string sensor;
  std::int64_t measurements = 0;
  double nis_mean = 0.0;      ///< mean of r' S^-1 r / dof; 1 is right
  double nis_within95 = 0.0;  ///< share with r' S^-1 r <= chi2(0.95, dof); 0.95 is right
  /// Autocorrelation of the elements of r, over their standard deviations, from one measurement of
  /// the sensor (and landmark) to the next [BarShalom2001] sec. 5.4; white: 0.
  double autocorrelation = 0.0;
  double white_within = 0.0;  ///< 1.96 / sqrt(products): that of a white one is within in 95 %
};
/// Of the sensors of a run's `NAME/innovations.csv`, sorted. Errors: kBadData, kInputMissing.
std::vector<InnovationStatistics> ReadInnovations(const std::filesystem::path& file);

/// How a trajectory is compared with a reference.
struct EvaluateOptions {
  Alignment alignment = Alignment::kNone;
  int align_poses = 0;  ///< the first of them alone are aligned; 0: all
  Timestamp max_diff = 10'000'000;
  Timestamp offset = 0;  ///< is added to the timestamps of the estimate
  std::vector<PoseRelation> relations = {PoseRelation::kTranslation, PoseRelation::kAngleDeg};
  PairOptions pairs;
};

/// One estimate compared with the reference, and all that is needed to read the figures right.
struct Evaluation {
  std::string label;
  EvaluateOptions options;
  int possible = 0;
  bool by_row = false;
  Trajectory reference, estimate;  ///< the poses that matched, the estimate aligned
  Similarity alignment;
  std::vector<std::pair<int, int>> pairs;  ///< of the relative errors
  std::vector<PoseErrors> absolute, relative;
  std::optional<double> sim3_scale;   ///< that kSim3 finds; none where Align finds none
  std::optional<double> scale_drift;  ///< scale of the second half over that of the first, - 1
  std::optional<Nees> position_nees, orientation_nees;
  std::string nees_withheld;  ///< why one lacks, where there are covariances
  std::vector<InnovationStatistics> innovations;
  std::vector<std::string> warnings;  ///< a line each
  std::string error;  ///< why there are no figures, where that is so; set by callers of Evaluate
};

/// Evaluates `estimate`. Warns of what makes the figures mean something else than they say: few
/// matches, timestamps that are off by a constant time, a swap of reference and estimate (seen by
/// names and covariances), a scale that is not metric, other world or body frames, quaternions in
/// the other order, a path that ends early, no pair of poses that is delta apart: then there are no
/// relative errors. Errors: those of Associate and Align.
Evaluation Evaluate(const Trajectory& reference, const Trajectory& estimate,
                    const EvaluateOptions& options);

}  // namespace alidade
