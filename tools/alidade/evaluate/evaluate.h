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

/// Transformation that is applied to the estimate before errors are computed. Except for kNone and
/// kOrigin, it fits the positions of the estimate to those of the reference by least squares
/// [Umeyama1991].
enum class Alignment {
  kNone,
  kScale,   ///< only the scale of kSim3, without rotation and translation
  kOrigin,  ///< rotation and translation that make the first poses equal
  kYaw,     ///< rotation about the world's z axis, and translation [Zhang2018]
  kSe3,     ///< rotation and translation
  kSim3,    ///< rotation, translation and scale
};
/// Returns `none`, `scale`, `origin`, `yaw`, `se3` or `sim3`.
const char* ToString(Alignment alignment);

/// Transforms the trajectory to the world frame of the reference. The result has no covariances.
Trajectory operator*(const Similarity& reference_from_estimate, const Trajectory& estimate);

/// Computes the transformation of `estimate` to `reference`. Uses the first `poses` poses of both
/// trajectories, or all poses if `poses` is 0. Pose i of both trajectories must match. Errors:
/// kBadData if there are fewer than 3 poses; for an alignment with scale, also if all positions are
/// at one point or uncorrelated.
Similarity Align(Alignment alignment, const Trajectory& reference, const Trajectory& estimate,
                 int poses = 0);

/// Range of timestamps, with its ends.
struct TimeRange {
  std::optional<Timestamp> start, end;  ///< nullopt: no limit

  bool is_unlimited() const { return !start && !end; }
  /// Returns true if the time is in the range; the ends count.
  bool Contains(Timestamp timestamp) const;
};
/// Returns the poses in the range. Error: kBadData if the range contains no pose, or if the
/// trajectory has no timestamps.
Trajectory Crop(const Trajectory& trajectory, const TimeRange& range);

/// Returns at most `poses` poses (0: all), equally spaced by index from the first to the last.
/// Pose k is that with index floor(k (size - 1) / (poses - 1)).
Trajectory Downsample(const Trajectory& trajectory, int poses);

/// Plane through the origin of the world.
enum class Plane { kNone, kXy, kXz, kYz };
/// Returns `none`, `xy`, `xz` or `yz`.
const char* ToString(Plane plane);

/// Projects the poses to the plane, as evo does. The coordinate along the normal becomes zero, and
/// the orientation Rz(c) Ry(b) Rx(a) becomes the rotation about the normal alone: Rz(c) for xy,
/// Ry(b) for xz with |b| <= pi/2, Rx(a) for yz. The result has no covariances.
Trajectory Project(const Trajectory& trajectory, Plane plane);

/// Matching poses: indices into the reference and the estimate.
struct Matches {
  std::vector<int> reference, estimate;
  int possible = 0;     ///< number of poses of the shorter trajectory
  bool by_row = false;  ///< true: matched by row, without timestamps
};
/// Matches each pose of the shorter trajectory with the nearest pose in time of the longer
/// trajectory, if their times differ by at most `max_diff`. If two poses are equally near, the
/// earlier one is used. If both trajectories are equally long, the estimate counts as the shorter
/// one. Several poses may match the same pose, as in evo. `offset` is added to the timestamps of
/// the estimate. Poses are matched by row if neither trajectory has timestamps. Two KITTI files are
/// matched by row unless both have timestamps.
/// Errors: kBadData if no poses match, if trajectories to match by row differ in length, if only
/// one trajectory has timestamps, or if the offset is out of the range of a timestamp. Matching by
/// row leaves out a row that was left out of either file.
Matches Associate(const Trajectory& reference, const Trajectory& estimate, Timestamp max_diff,
                  Timestamp offset);

/// Scalar error that is computed from the error pose E [Sturm2012]. The absolute error pose is
/// E = est^-1 ref. The relative error pose is E = (ref_i^-1 ref_j)^-1 (est_i^-1 est_j). t is the
/// translation of E, R is the rotation of E.
enum class PoseRelation {
  kTranslation,    ///< |t|, m
  kRotation,       ///< |R - I|, Frobenius norm
  kAngleDeg,       ///< angle of R, degrees
  kAngleRad,       ///< angle of R, rad
  kFull,           ///< |E - I|, Frobenius norm
  kPointDistance,  ///< absolute: |t|; relative: | |p_i - p_j|_ref - |p_i - p_j|_est |, m
};
/// Returns `trans_part`, `rot_part`, `angle_deg`, `angle_rad`, `full` or `point_distance`.
const char* ToString(PoseRelation relation);
/// Returns `m`, `deg`, `rad`, or "" for a relation without a unit.
const char* UnitOf(PoseRelation relation);

/// Unit of the interval between the two poses of a relative error: frames, metres along the
/// trajectory, seconds, degrees or rad of rotation.
enum class DeltaUnit { kFrames, kMetres, kSeconds, kDegrees, kRadians };
/// Returns `f`, `m`, `s`, `d` or `r`.
const char* ToString(DeltaUnit unit);

/// Selection of the pairs of poses for relative errors.
struct PairOptions {
  double delta = 1.0;  ///< interval, > 0; a whole number for frames
  DeltaUnit unit = DeltaUnit::kFrames;
  /// True: a pair starts at each pose. False: a pair starts at the end of the previous pair.
  bool all = false;
  /// Tolerated deviation from delta, as a fraction of delta. Used only if `all` is true and the
  /// unit is not frames.
  double tolerance = 0.1;
};
/// Returns pairs (i, j), i < j, of poses of the estimate.
/// Consecutive pairs: a pair ends at the first pose that is at least delta after the start of the
/// pair. Metres are measured along the trajectory, and angles are accumulated. In metres, as in
/// evo, the first pair starts at the first pose that is at least delta after the first pose.
/// All pairs: for each i, j is the pose whose distance from i is nearest to delta. For angles, j is
/// each pose whose rotation from i is within the tolerance of delta. Error: kBadData if there are
/// no pairs.
std::vector<std::pair<int, int>> PairsOf(const Trajectory& estimate, const PairOptions& options);

/// Statistics of n errors e: rmse = sqrt(mean e^2), std = sqrt(mean (e - mean e)^2), sse = sum e^2.
struct ErrorStatistics {
  double rmse = 0.0, mean = 0.0, median = 0.0, std = 0.0, min = 0.0, max = 0.0, sse = 0.0;
};
/// Computes the statistics of at least one error.
ErrorStatistics StatisticsOf(std::vector<double> errors);

/// Errors of one relation and their statistics.
struct PoseErrors {
  PoseRelation relation = PoseRelation::kTranslation;
  std::vector<double> errors;
  ErrorStatistics statistics;
};

/// Statistics of the NEES e' C^-1 e / dof over the poses whose covariance C is regular.
struct Nees {
  int poses = 0;
  double mean = 0.0;  ///< mean of the NEES; expected value: 1
  /// Share of poses with e' C^-1 e <= chi2(0.95, dof). Expected value: 0.95.
  double within95 = 0.0;
  int dof = 3;  ///< number of axes with uncertainty in at least one pose
};

/// Consistency of the accepted measurements of a sensor with the predictions of the filter.
struct InnovationStatistics {
  std::string sensor;
  std::int64_t measurements = 0;
  double nis_mean = 0.0;  ///< mean of r' S^-1 r / dof; expected value: 1
  /// Share of measurements with r' S^-1 r <= chi2(0.95, dof). Expected value: 0.95.
  double nis_within95 = 0.0;
  /// Autocorrelation of the normalised elements of r between consecutive measurements of the sensor
  /// (and landmark) [BarShalom2001, sec. 5.4]. Expected value for white innovations: 0.
  double autocorrelation = 0.0;
  /// 95 % bound of |autocorrelation| for white innovations: 1.96 / sqrt(number of products).
  double white_within = 0.0;
};
/// Reads `NAME/innovations.csv` of a run. Returns the statistics of each sensor, sorted by name.
/// Errors: kBadData, kInputMissing.
std::vector<InnovationStatistics> ReadInnovations(const std::filesystem::path& file);

/// Options of the comparison of a trajectory with a reference.
struct EvaluateOptions {
  Alignment alignment = Alignment::kNone;
  int align_poses = 0;  ///< number of leading poses that determine the alignment; 0: all
  Timestamp max_diff = 10'000'000;
  Timestamp offset = 0;  ///< added to the timestamps of the estimate
  std::vector<PoseRelation> relations = {PoseRelation::kTranslation, PoseRelation::kAngleDeg};
  PairOptions pairs;
  int downsample = 0;          ///< number of poses of both trajectories before matching; 0: all
  TimeRange range;             ///< range of the reference, and so of its matches
  Plane plane = Plane::kNone;  ///< plane of both trajectories after the alignment
};

/// Result of the comparison of one estimate with the reference.
struct Evaluation {
  std::string label;
  EvaluateOptions options;
  int possible = 0;
  bool by_row = false;
  Trajectory reference, estimate;  ///< the matched poses; aligned and projected
  Similarity alignment;
  std::vector<std::pair<int, int>> pairs;  ///< pairs of the relative errors
  std::vector<PoseErrors> absolute, relative;
  std::optional<double> sim3_scale;  ///< scale of kSim3, if it is determined
  /// (Scale of the second half) / (scale of the first half) - 1.
  std::optional<double> scale_drift;
  std::optional<Nees> position_nees, orientation_nees;
  std::string nees_withheld;  ///< reason for a missing NEES if the estimate has covariances
  std::vector<InnovationStatistics> innovations;
  std::vector<std::string> warnings;  ///< warnings, each a single line
  /// Reason why there are no results, or "". The caller of Evaluate() sets it.
  std::string error;
};

/// Evaluates `estimate`. Warns of conditions under which the results are misleading:
///
///   - few matches, or an estimate that covers only part of the reference
///   - numbers of frames in place of timestamps
///   - positions that do not determine the alignment, such as those of a camera at rest
///   - a constant time offset
///   - an exchange of reference and estimate, which is detected by names and covariances
///   - a scale that is not metric
///   - different world or body frames, or quaternions in the other order
///
/// If no two poses are delta apart, the function warns and omits the relative errors. Errors: those
/// of Associate() and Align().
Evaluation Evaluate(const Trajectory& reference, const Trajectory& estimate,
                    const EvaluateOptions& options);

}  // namespace alidade
