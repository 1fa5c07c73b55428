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

/// Transformation of the estimate, applied before errors are computed. It fits the positions to
/// the reference by least squares [Umeyama1991].
enum class Alignment {
  kNone,
  kScale,   ///< the scale of kSim3, without its rotation and translation
  kOrigin,  ///< makes the first poses equal
  kYaw,     ///< rotation about the world's z axis, and translation [Zhang2018]
  kSe3,     ///< rotation and translation
  kSim3,    ///< rotation, translation and scale
};
/// Returns `none`, `scale`, `origin`, `yaw`, `se3` or `sim3`.
const char* ToString(Alignment alignment);

/// Transforms the trajectory to the world of the reference, without covariances.
Trajectory operator*(const Similarity& reference_from_estimate, const Trajectory& estimate);

/// Computes the transformation of `estimate` to `reference` from their first `poses` poses (0:
/// all). Both have the same poses in the same order. Errors: kBadData if a rotation has fewer than
/// 3 poses; or if a scale has all positions at one point, or uncorrelated positions.
Similarity Align(Alignment alignment, const Trajectory& reference, const Trajectory& estimate,
                 int poses = 0);

/// Pairs of poses (reference, estimate) with the same time.
struct Matches {
  std::vector<int> reference, estimate;
  int possible = 0;     ///< number of poses of the shorter trajectory
  bool by_row = false;  ///< matched without timestamps
};
/// Matches each pose of the shorter trajectory with the pose of the longer that is nearest in time,
/// if it is within `max_diff`. Of equally near poses the first matches; of equally long
/// trajectories the estimate counts as the shorter. Several poses may match the same pose, as in
/// evo. `offset` is added to the timestamps of the estimate. Poses match by row if neither
/// trajectory has timestamps, or if both are KITTI files and one has none.
/// Errors: kBadData if nothing matches, if the numbers of rows differ, if only one trajectory has
/// timestamps, or if the offset is out of the range of a timestamp.
Matches Associate(const Trajectory& reference, const Trajectory& estimate, Timestamp max_diff,
                  Timestamp offset);

/// Scalar error computed from the error pose E [Sturm2012]. The absolute error pose is
/// E = est^-1 ref, the relative one E = (ref_i^-1 ref_j)^-1 (est_i^-1 est_j). t is the translation
/// of E, R its rotation.
enum class PoseRelation {
  kTranslation,    ///< |t|, m
  kRotation,       ///< |R - I|, Frobenius
  kAngleDeg,       ///< angle of R, degrees
  kAngleRad,       ///< angle of R, rad
  kFull,           ///< |E - I|, Frobenius
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
  double delta = 1.0;  ///< > 0; a whole number if in frames
  DeltaUnit unit = DeltaUnit::kFrames;
  bool all = false;  ///< a pair starts at each pose; else at the end of the previous pair
  /// For all pairs in units other than frames: tolerated deviation from delta, as a fraction of it.
  double tolerance = 0.1;
};
/// Returns pairs (i, j), i < j, of poses of the estimate.
/// Consecutive pairs: each ends at the first pose that is at least delta after its start. Metres
/// are measured along the trajectory and angles are accumulated. In metres the first pair starts,
/// as in evo, at the first pose that is delta after the first pose.
/// All pairs: j is the pose nearest to delta after i; for angles, each pose whose rotation from i
/// is within the tolerance of delta. Error: kBadData if there are no pairs.
std::vector<std::pair<int, int>> PairsOf(const Trajectory& estimate, const PairOptions& options);

/// Statistics of errors e: rmse = sqrt(mean e^2), std about the mean over n, sse = sum e^2.
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

/// NEES e' C^-1 e / dof over the poses whose covariance C is regular.
struct Nees {
  int poses = 0;
  double mean = 0.0;      ///< expected value: 1
  double within95 = 0.0;  ///< share with e' C^-1 e <= chi2(0.95, dof); expected value: 0.95
  int dof = 3;            ///< axes with uncertainty in at least one pose; planar pose: 2 and 1
};

/// Consistency of the accepted measurements of a sensor with the predictions of the filter.
struct InnovationStatistics {
  std::string sensor;
  std::int64_t measurements = 0;
  double nis_mean = 0.0;      ///< mean of r' S^-1 r / dof; expected value: 1
  double nis_within95 = 0.0;  ///< share with r' S^-1 r <= chi2(0.95, dof); expected value: 0.95
  /// Autocorrelation of the elements of r, divided by their standard deviations, between
  /// consecutive measurements of the sensor (and landmark) [BarShalom2001] sec. 5.4; white: 0.
  double autocorrelation = 0.0;
  double white_within = 0.0;  ///< 95 % bound of |autocorrelation| if white: 1.96 / sqrt(products)
};
/// Reads a run's `NAME/innovations.csv`. Returns the statistics of its sensors, sorted by name.
/// Errors: kBadData, kInputMissing.
std::vector<InnovationStatistics> ReadInnovations(const std::filesystem::path& file);

/// Options of the comparison of a trajectory with a reference.
struct EvaluateOptions {
  Alignment alignment = Alignment::kNone;
  int align_poses = 0;  ///< number of leading poses that determine the alignment; 0: all
  Timestamp max_diff = 10'000'000;
  Timestamp offset = 0;  ///< is added to the timestamps of the estimate
  std::vector<PoseRelation> relations = {PoseRelation::kTranslation, PoseRelation::kAngleDeg};
  PairOptions pairs;
};

/// Result of the comparison of one estimate with the reference.
struct Evaluation {
  std::string label;
  EvaluateOptions options;
  int possible = 0;
  bool by_row = false;
  Trajectory reference, estimate;  ///< the matched poses, with the estimate aligned
  Similarity alignment;
  std::vector<std::pair<int, int>> pairs;  ///< pairs of the relative errors
  std::vector<PoseErrors> absolute, relative;
  std::optional<double> sim3_scale;   ///< scale of kSim3, if it exists
  std::optional<double> scale_drift;  ///< (scale of the second half) / (scale of the first) - 1
  std::optional<Nees> position_nees, orientation_nees;
  std::string nees_withheld;  ///< reason for a missing NEES, if the estimate has covariances
  std::vector<InnovationStatistics> innovations;
  std::vector<std::string> warnings;  ///< one line each
  std::string error;  ///< reason why there are no results, or ""; set by callers of Evaluate
};

/// Evaluates `estimate`. Warns of conditions under which the results are misleading: few matches,
/// a constant time offset, a swap of reference and estimate (detected by names and covariances), a
/// scale that is not metric, different world or body frames, quaternions in the other order, an
/// estimate that covers only part of the reference. If no two poses are delta apart, it warns and
/// omits the relative errors. Errors: those of Associate and Align.
Evaluation Evaluate(const Trajectory& reference, const Trajectory& estimate,
                    const EvaluateOptions& options);

}  // namespace alidade
