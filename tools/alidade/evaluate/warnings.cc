// SPDX-License-Identifier: Apache-2.0
#include "alidade/evaluate/warnings.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <optional>
#include <utility>

#include "alidade/base/error.h"
#include "alidade/base/number_text.h"
#include "alidade/evaluate/errors.h"
#include "alidade/state/dense_algebra.h"

namespace alidade {
namespace {

using internal::EigenOf;
using internal::EigenvaluesOf;
using internal::RoundedText;

constexpr int kMinPoses = 10;             ///< minimum number of poses to check frames and scale
constexpr double kMinMatches = 0.5;       ///< minimum share of matched poses
constexpr double kMaxTimeOffset = 0.5;    ///< maximum of median time difference / tolerance
constexpr double kMaxScaleError = 0.1;    ///< maximum relative deviation of the scale from 1
constexpr double kMinLength = 0.5;        ///< minimum of matched length / reference length
constexpr double kMaxErrorRatio = 10.0;   ///< maximum of error without / error with alignment
constexpr double kMinBodyTurnDeg = 10.0;  ///< a larger common turn is not an estimation error
constexpr double kMaxRemainder = 0.25;    ///< maximum of error after / before a correction
constexpr double kMinMirrorError = 0.01;  ///< minimum error of a reflection / extent
constexpr double kMinExplained = 0.5;     ///< minimum share of the variance that sim3 explains
constexpr const char* kTimesOfFrames = "the time of each frame, from the list of its images";
constexpr const char* kEurocTruth = "state_groundtruth_estimate0";
constexpr double kDegrees = 180.0 / std::numbers::pi;

double Rmse(const Trajectory& reference, const Trajectory& estimate) {
  return internal::AbsoluteErrors(PoseRelation::kTranslation, reference, estimate).statistics.rmse;
}

/// Returns true if a file is named like ground truth. Its folder is the ground-truth folder of
/// EuRoC, or its name contains `truth`, or its name contains `gt` as a word.
bool IsNamedLikeTruth(const std::string& file) {
  const std::filesystem::path path = file;
  if (path.parent_path().filename() == kEurocTruth) return true;
  std::string name = path.filename().string(), word;
  for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (name.find("truth") != name.npos) return true;
  for (const char c : name + '.') {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      word += c;
      continue;
    }
    if (word == "gt") return true;
    word.clear();
  }
  return false;
}

/// Difference between the orientations of two trajectories in the same world: a common turn d of
/// the body, ref = est Exp(d), and the rms deviation of the poses from this turn.
struct BodyTurn {
  double turn_deg, spread_deg;
};

/// Computes the turn as the mean of est^-1 ref [Markley2007].
BodyTurn BodyTurnOf(const Trajectory& reference, const Trajectory& estimate) {
  Eigen::Matrix4d moment = Eigen::Matrix4d::Zero();
  std::vector<Eigen::Quaterniond> turns;
  for (std::size_t i = 0; i < reference.orientations.size(); ++i) {
    turns.push_back(estimate.orientations[i].conjugate() * reference.orientations[i]);
    moment += turns.back().coeffs() * turns.back().coeffs().transpose();
  }
  const Eigen::Quaterniond mean(Eigen::Vector4d(EigenOf(moment).vectors.col(3)));
  double sum = 0.0;
  for (const Eigen::Quaterniond& q : turns) {
    const double angle = mean.angularDistance(q);
    sum += angle * angle;
  }
  return {kDegrees * mean.angularDistance(Eigen::Quaterniond::Identity()),
          kDegrees * std::sqrt(sum / static_cast<double>(turns.size()))};
}

/// Returns true if the positions determine a rotation, that is, if they are not nearly collinear.
bool SpansAPlane(const Eigen::Matrix3Xd& points) {
  constexpr double kThin = 1e-3;
  const Eigen::Matrix3Xd centred = points.colwise() - points.rowwise().mean();
  const Eigen::VectorXd squared_widths = EigenvaluesOf(centred * centred.transpose());
  return squared_widths[1] > kThin * kThin * squared_widths[2];
}

/// Returns true if `sim3` with the scale s explains at least half of the variance of the reference,
/// s^2 var(estimate) >= 0.5 var(reference).
bool AreCorrelated(const Eigen::Matrix3Xd& reference, const Eigen::Matrix3Xd& estimate) {
  const std::optional<Similarity> sim3 = internal::FindSimilarity(estimate, reference);
  return sim3 && sim3->scale * sim3->scale * internal::SquaredExtent(estimate) >=
                     kMinExplained * internal::SquaredExtent(reference);
}

/// Returns the unit of positions whose size in m is the scale, to 2 %. Returns nullptr if the scale
/// is that of no usual unit.
const char* UnitOfScale(double scale) {
  constexpr double kTolerance = 0.02;
  constexpr std::pair<double, const char*> kUnits[] = {
      {1e-3, "mm"}, {1e-2, "cm"}, {0.3048, "feet"}, {1e3, "km"}};
  for (const auto& [size_m, unit] : kUnits) {
    if (std::abs(std::log(scale / size_m)) < kTolerance) return unit;
  }
  return nullptr;
}

/// Returns the subject of a sentence: the quantities that positions determine in an alignment.
std::string UndeterminedText(Alignment alignment) {
  if (alignment == Alignment::kScale) return "the scale is";
  if (alignment == Alignment::kSim3) return "the rotation and the scale of sim3 are";
  return std::string("the rotation of ") + ToString(alignment) + " is";
}

/// Returns true if the timestamps may be numbers of frames: whole numbers below 1e8 in the unit of
/// the file, 1 to 100 apart in the median.
bool MayBeFrameNumbers(const Trajectory& trajectory) {
  const std::vector<Timestamp>& timestamps = trajectory.timestamps;
  const Timestamp unit = trajectory.format == TrajectoryFormat::kEuroc ? 1 : 1'000'000'000;
  if (timestamps.size() < 3 || timestamps.back() >= 100'000'000 * unit) return false;
  std::vector<Timestamp> steps;
  for (std::size_t i = 0; i < timestamps.size(); ++i) {
    if (timestamps[i] % unit != 0 || timestamps[i] < 0) return false;
    if (i > 0) steps.push_back(timestamps[i] - timestamps[i - 1]);
  }
  const auto median = steps.begin() + std::ssize(steps) / 2;
  std::nth_element(steps.begin(), median, steps.end());
  return *median >= unit && *median <= 100 * unit;
}

/// Returns the trajectory whose timestamps may be numbers of frames, if those of the other cannot.
/// Otherwise returns nullptr.
const Trajectory* WithFrameNumbers(const Trajectory& reference, const Trajectory& estimate) {
  const bool reference_may = MayBeFrameNumbers(reference),
             estimate_may = MayBeFrameNumbers(estimate);
  if (reference_may == estimate_may) return nullptr;
  return reference_may ? &reference : &estimate;
}

/// Collector of the warnings of one evaluation.
class WarningCollector {
 public:
  WarningCollector(const Evaluation& evaluation, const Matches& matches,
                   const Trajectory& reference, const Trajectory& estimate)
      : evaluation_(evaluation),
        matches_(matches),
        whole_reference_(reference),
        whole_estimate_(estimate) {}

  std::vector<std::string> Collect() {
    CheckOrder();
    CheckMatches();
    CheckTimestamps();
    CheckPath();
    CheckAlignment();
    const Trajectory& reference = evaluation_.reference;
    if (reference.size() < kMinPoses) return warnings_;
    if (!AreCorrelated(reference.positions, evaluation_.estimate.positions)) return warnings_;
    const Similarity sim3 = Align(Alignment::kSim3, reference, evaluation_.estimate);
    CheckScale(sim3);
    CheckReflection(sim3);
    CheckWorld();
    const bool planar =
        SpansAPlane(reference.positions) && SpansAPlane(evaluation_.estimate.positions);
    if (planar) {
      CheckOrientations(sim3);
    } else {
      CheckLine();
    }
    return warnings_;
  }

 private:
  void Warn(const std::string& problem, const std::string& remedy) {
    warnings_.push_back(ErrorLine({whole_estimate_.name}, {}, problem, remedy));
  }

  /// Detects by names and covariances that reference and estimate are exchanged. The numbers of
  /// poses cannot reveal this error, because the truth may have a lower rate than the estimate.
  void CheckOrder() {
    const Trajectory &reference = whole_reference_, &estimate = whole_estimate_;
    const char* const remedy = "REF first, then EST";
    if (IsNamedLikeTruth(estimate.name) && !IsNamedLikeTruth(reference.name)) {
      Warn("the file is named like ground truth, but is used as the estimate; the reference is " +
               reference.name,
           remedy);
    } else if (reference.has_covariances() && !estimate.has_covariances()) {
      warnings_.push_back(
          ErrorLine({reference.name}, {},
                    "the reference has covariances, as an estimate does, but the estimate " +
                        estimate.name + " does not have covariances",
                    remedy));
    }
  }

  void CheckMatches() {
    const int matched = evaluation_.estimate.size();
    if (matched >= kMinMatches * matches_.possible) return;
    if (const Trajectory* numbered = WithFrameNumbers(whole_reference_, whole_estimate_)) {
      warnings_.push_back(
          ErrorLine({numbered->name, numbered->first_line, 0}, "t",
                    std::to_string(matched) + " of " + std::to_string(matches_.possible) +
                        " possible poses match: the timestamps are probably numbers of frames",
                    kTimesOfFrames));
      return;
    }
    Warn(std::to_string(matched) + " of " + std::to_string(matches_.possible) +
             " possible poses match within " + RoundedText(Seconds(evaluation_.options.max_diff)) +
             " s",
         "the same clock and rate, or the options --t-offset and --t-max-diff");
  }

  void CheckTimestamps() {
    if (matches_.by_row) return;
    std::vector<Timestamp> differences;
    for (std::size_t k = 0; k < matches_.estimate.size(); ++k) {
      differences.push_back(evaluation_.reference.timestamps[k] -
                            (evaluation_.estimate.timestamps[k] + evaluation_.options.offset));
    }
    const auto middle = differences.begin() + std::ssize(differences) / 2;
    std::nth_element(differences.begin(), middle, differences.end());
    const double offset_s = std::abs(Seconds(*middle));
    if (!(offset_s > kMaxTimeOffset * Seconds(evaluation_.options.max_diff))) return;
    Warn("the timestamps are " + RoundedText(offset_s) + " s " +
             (*middle > 0 ? "before" : "after") + " those of the reference (median difference)",
         "the option --t-offset " + RoundedText(Seconds(evaluation_.options.offset + *middle)));
  }

  void CheckPath() {
    const double length = whole_reference_.Length(0, whole_reference_.size() - 1);
    const double matched =
        whole_reference_.Length(matches_.reference.front(), matches_.reference.back());
    if (!(matched < kMinLength * length)) return;
    Warn("the estimate covers only " + RoundedText(matched, 3) + " m of the " +
             RoundedText(length, 3) + " m of the reference",
         "an estimate of the whole trajectory");
  }

  /// Warns if the positions that determine the alignment are not correlated. Those of a motionless
  /// trajectory are equal except for noise.
  void CheckAlignment() {
    const EvaluateOptions& options = evaluation_.options;
    if (options.alignment == Alignment::kNone || options.alignment == Alignment::kOrigin) return;
    const Eigen::Index poses = evaluation_.estimate.size();
    const Eigen::Index used =
        options.align_poses == 0 ? poses : std::min<Eigen::Index>(poses, options.align_poses);
    const Eigen::Matrix3Xd reference = evaluation_.reference.positions.leftCols(used);
    const Eigen::Matrix3Xd estimate = evaluation_.estimate.positions.leftCols(used);
    if (AreCorrelated(reference, estimate)) return;
    const auto spread = [](const Eigen::Matrix3Xd& points) {
      return RoundedText(std::sqrt(internal::SquaredExtent(points)), 3) + " m";
    };
    Warn(UndeterminedText(options.alignment) + " undetermined: the positions of " +
             std::to_string(used) + " poses are uncorrelated, with a spread of " +
             spread(estimate) + " in the estimate and " + spread(reference) + " in the reference",
         "poses that move, --align-origin or no alignment");
  }

  void CheckScale(const Similarity& sim3) {
    const Alignment alignment = evaluation_.options.alignment;
    if (alignment == Alignment::kSim3 || alignment == Alignment::kScale) return;
    if (std::abs(std::log(sim3.scale)) <= std::log1p(kMaxScaleError)) return;
    const Similarity se3 = Align(Alignment::kSe3, evaluation_.reference, evaluation_.estimate);
    const double sim3_error = Rmse(evaluation_.reference, sim3 * evaluation_.estimate);
    const double se3_error = Rmse(evaluation_.reference, se3 * evaluation_.estimate);
    if (!(sim3_error < 0.5 * se3_error)) return;
    const char* const unit = UnitOfScale(sim3.scale);
    Warn("the scale is " + RoundedText(sim3.scale, 4) + " (the error is " +
             RoundedText(sim3_error, 4) + " m with sim3 and " + RoundedText(se3_error, 4) +
             " m with se3): the estimate " +
             (unit == nullptr ? "probably has no metric scale"
                              : std::string("is probably in ") + unit),
         unit == nullptr ? "the option -as, which aligns with scale"
                         : "positions in m, or the option -as, which aligns with scale");
  }

  /// Detects an axis with the opposite direction, which no rotation corrects.
  void CheckReflection(const Similarity& sim3) {
    const Trajectory& reference = evaluation_.reference;
    Trajectory mirrored = evaluation_.estimate;
    mirrored.positions.row(0) *= -1.0;
    const double original_error = Rmse(reference, sim3 * evaluation_.estimate);
    const double mirrored_error =
        Rmse(reference, Align(Alignment::kSim3, reference, mirrored) * mirrored);
    const double extent = std::sqrt(internal::SquaredExtent(reference.positions));
    if (!(original_error > kMinMirrorError * extent)) return;
    if (!(mirrored_error < kMaxRemainder * original_error)) return;
    Warn("the error with sim3 is " + RoundedText(mirrored_error, 4) +
             " m if the estimate is mirrored, but " + RoundedText(original_error, 4) +
             " m otherwise: an axis probably has the opposite direction",
         "axes of a right-handed frame in both files");
  }

  void CheckWorld() {
    if (evaluation_.options.alignment != Alignment::kNone) return;
    const Similarity se3 = Align(Alignment::kSe3, evaluation_.reference, evaluation_.estimate);
    const double aligned_error = Rmse(evaluation_.reference, se3 * evaluation_.estimate);
    const double original = Rmse(evaluation_.reference, evaluation_.estimate);
    if (!(original > kMaxErrorRatio * aligned_error)) return;
    Warn("the error is " + RoundedText(original, 4) + " m without alignment and " +
             RoundedText(aligned_error, 4) + " m with se3: the world frames probably differ",
         "the option --align");
  }

  void CheckLine() {
    const Alignment alignment = evaluation_.options.alignment;
    if (alignment != Alignment::kSe3 && alignment != Alignment::kSim3) return;
    Warn("the positions of the estimate or the reference are collinear: the rotation of " +
             std::string(ToString(alignment)) +
             " about the line and the orientation errors are arbitrary",
         "no alignment, --align-origin or --align-mode yaw for orientation errors");
  }

  void CheckOrientations(const Similarity& sim3) {
    const Trajectory& reference = evaluation_.reference;
    const Trajectory& estimate = evaluation_.estimate;
    const BodyTurn original = BodyTurnOf(reference, sim3 * estimate);
    const BodyTurn estimate_reordered =
        BodyTurnOf(reference, sim3 * estimate.WithOtherQuaternionOrder());
    const BodyTurn reference_reordered =
        BodyTurnOf(reference.WithOtherQuaternionOrder(), sim3 * estimate);
    // If the body turns about one axis only, both files may fit in the other order.
    const bool estimate_is_wrong =
        estimate_reordered.spread_deg * kMaxRemainder <= reference_reordered.spread_deg;
    const bool is_ambiguous =
        estimate_is_wrong && reference_reordered.spread_deg < kMaxRemainder * original.spread_deg;
    const double reordered_spread_deg =
        std::min(estimate_reordered.spread_deg, reference_reordered.spread_deg);
    if (original.spread_deg > kMinBodyTurnDeg &&
        reordered_spread_deg < kMaxRemainder * original.spread_deg) {
      const Trajectory& wrong = estimate_is_wrong ? whole_estimate_ : whole_reference_;
      const bool w_first = wrong.format == TrajectoryFormat::kEuroc;
      const std::string other_file =
          is_ambiguous ? "; the other order of " + whole_reference_.name + " fits as well" : "";
      warnings_.push_back(ErrorLine({wrong.name, wrong.first_line, 0}, {},
                                    "the orientations agree to " +
                                        internal::FixedText(reordered_spread_deg, 1) +
                                        " deg if quaternions are read with w " +
                                        (w_first ? "last, but only to " : "first, but only to ") +
                                        internal::FixedText(original.spread_deg, 1) +
                                        " deg with w " + (w_first ? "first" : "last") + other_file,
                                    w_first ? "qw qx qy qz" : "qx qy qz qw"));
    } else if (original.turn_deg > kMinBodyTurnDeg &&
               original.spread_deg < kMaxRemainder * original.turn_deg) {
      Warn("all orientations differ by the same rotation of " + RoundedText(original.turn_deg, 4) +
               " deg: the body frames probably differ",
           "poses of the same body frame; the positions may also belong to different points");
    }
  }

  const Evaluation& evaluation_;  ///< evaluation, in which the estimate is not aligned yet
  const Matches& matches_;
  const Trajectory& whole_reference_;
  const Trajectory& whole_estimate_;
  std::vector<std::string> warnings_;
};

}  // namespace

std::string internal::FrameNumberRemedy(const Trajectory& reference, const Trajectory& estimate) {
  const Trajectory* const numbered = WithFrameNumbers(reference, estimate);
  if (numbered == nullptr) return {};
  return std::string(kTimesOfFrames) + ", because the timestamps of " + numbered->name +
         " are probably numbers of frames; or ";
}

std::vector<std::string> internal::EvaluationWarnings(const Evaluation& evaluation,
                                                      const Matches& matches,
                                                      const Trajectory& reference,
                                                      const Trajectory& estimate) {
  return WarningCollector(evaluation, matches, reference, estimate).Collect();
}

}  // namespace alidade
