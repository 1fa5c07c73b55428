// SPDX-License-Identifier: Apache-2.0
#include "alidade/evaluate/warnings.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "alidade/base/error.h"
#include "alidade/base/number_text.h"
#include "alidade/evaluate/errors.h"
#include "alidade/state/dense_algebra.h"

namespace alidade {
namespace {

using internal::EigenOf;
using internal::EigenvaluesOf;
using internal::RoundedText;

constexpr int kFewPoses = 10;            ///< tell nothing about frames and scale
constexpr double kFewMatches = 0.5;      ///< share of those possible
constexpr double kLateTimestamps = 0.5;  ///< median difference, as a share of the tolerance
constexpr double kMetricScale = 0.1;     ///< off 1
constexpr double kShortPath = 0.5;       ///< share of the reference's
constexpr double kOtherWorld = 10.0;     ///< error without alignment over that with
constexpr double kBodyTurnDeg = 10.0;    ///< a turn of the body that is no error of an estimate
constexpr double kClearly = 0.25;        ///< what explains the rest
constexpr const char* kEurocTruth = "state_groundtruth_estimate0";
constexpr double kDegrees = 180.0 / 3.14159265358979323846;

double Rmse(const Trajectory& reference, const Trajectory& estimate) {
  return internal::AbsoluteErrors(PoseRelation::kTranslation, reference, estimate).statistics.rmse;
}

/// Whether a file is named like ground truth: its name, or that of EuRoC's folder, has `truth` in
/// it, or `gt` as a word.
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

/// How the orientations of two trajectories of one world differ: by one turn of the body,
/// ref = est Exp(d), and by what each pose is off that, rms.
struct BodyTurn {
  double turn_deg, spread_deg;
};

/// The turn is the mean of [Markley2007], of est^-1 ref.
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

/// Whether the positions determine a rotation: not all nearly on one line.
bool SpansAPlane(const Eigen::Matrix3Xd& points) {
  constexpr double kThin = 1e-3;
  const Eigen::Matrix3Xd centred = points.colwise() - points.rowwise().mean();
  const Eigen::VectorXd squared_widths = EigenvaluesOf(centred * centred.transpose());
  return squared_widths[1] > kThin * kThin * squared_widths[2];
}

/// Collects the warnings of one evaluation.
class Warnings {
 public:
  Warnings(const Evaluation& evaluation, const Matches& matches, const Trajectory& reference,
           const Trajectory& estimate)
      : evaluation_(evaluation),
        matches_(matches),
        whole_reference_(reference),
        whole_estimate_(estimate) {}

  std::vector<std::string> Take() {
    CheckOrder();
    CheckMatches();
    CheckTimestamps();
    CheckPath();
    if (evaluation_.estimate.size() < kFewPoses || !evaluation_.sim3_scale) return warnings_;
    const Trajectory& reference = evaluation_.reference;
    const Similarity sim3 = Align(Alignment::kSim3, reference, evaluation_.estimate);
    CheckScale(sim3);
    CheckWorld();
    const bool turned =
        SpansAPlane(reference.positions) && SpansAPlane(evaluation_.estimate.positions);
    if (turned) {
      CheckOrientations(sim3);
    } else {
      CheckLine();
    }
    return warnings_;
  }

 private:
  void Warn(const std::string& what, const std::string& remedy) {
    warnings_.push_back(ErrorLine({whole_estimate_.name}, {}, what, remedy));
  }

  /// Sees that the reference and the estimate are swapped. Numbers of poses would not do: truth may
  /// be at a lower rate, too.
  void CheckOrder() {
    const Trajectory &reference = whole_reference_, &estimate = whole_estimate_;
    const char* const remedy = "REF first, then EST";
    if (IsNamedLikeTruth(estimate.name) && !IsNamedLikeTruth(reference.name)) {
      Warn("is named like ground truth, but is compared with " + reference.name, remedy);
    } else if (reference.has_covariances() && !estimate.has_covariances()) {
      warnings_.push_back(ErrorLine(
          {reference.name}, {},
          "has covariances, as an estimate does, and " + estimate.name + " has none", remedy));
    }
  }

  void CheckMatches() {
    const int matched = evaluation_.estimate.size();
    if (matched >= kFewMatches * matches_.possible) return;
    Warn(std::to_string(matched) + " of " + std::to_string(matches_.possible) +
             " possible poses match within " + RoundedText(Seconds(evaluation_.options.max_diff)) +
             " s",
         "the same clock and rate; --t-offset, --t-max-diff");
  }

  void CheckTimestamps() {
    if (matches_.by_row) return;
    std::vector<Timestamp> off;
    for (std::size_t k = 0; k < matches_.estimate.size(); ++k) {
      off.push_back(evaluation_.reference.timestamps[k] -
                    (evaluation_.estimate.timestamps[k] + evaluation_.options.offset));
    }
    const auto middle = off.begin() + std::ssize(off) / 2;
    std::nth_element(off.begin(), middle, off.end());
    const double late_s = std::abs(Seconds(*middle));
    if (!(late_s > kLateTimestamps * Seconds(evaluation_.options.max_diff))) return;
    Warn("its timestamps are " + RoundedText(late_s) + " s " + (*middle > 0 ? "before" : "after") +
             " those of the reference on the median",
         "--t-offset " + RoundedText(Seconds(evaluation_.options.offset + *middle)));
  }

  void CheckPath() {
    const double whole = whole_reference_.Length(0, whole_reference_.size() - 1);
    const double matched =
        whole_reference_.Length(matches_.reference.front(), matches_.reference.back());
    if (!(matched < kShortPath * whole)) return;
    Warn("it covers " + RoundedText(matched, 3) + " m of the reference's trajectory of " +
             RoundedText(whole, 3) + " m",
         "a figure of the whole trajectory");
  }

  void CheckScale(const Similarity& sim3) {
    const Alignment alignment = evaluation_.options.alignment;
    if (alignment == Alignment::kSim3 || alignment == Alignment::kScale) return;
    if (std::abs(std::log(sim3.scale)) <= std::log1p(kMetricScale)) return;
    const Similarity se3 = Align(Alignment::kSe3, evaluation_.reference, evaluation_.estimate);
    const double with_scale = Rmse(evaluation_.reference, sim3 * evaluation_.estimate);
    const double without = Rmse(evaluation_.reference, se3 * evaluation_.estimate);
    if (!(with_scale < 0.5 * without)) return;
    Warn("scale " + RoundedText(sim3.scale, 4) + " (error " + RoundedText(with_scale, 4) +
             " m by sim3, " + RoundedText(without, 4) +
             " m by se3): looks like a run without metric scale",
         "-as");
  }

  void CheckWorld() {
    if (evaluation_.options.alignment != Alignment::kNone) return;
    const Similarity se3 = Align(Alignment::kSe3, evaluation_.reference, evaluation_.estimate);
    const double aligned = Rmse(evaluation_.reference, se3 * evaluation_.estimate);
    const double as_is = Rmse(evaluation_.reference, evaluation_.estimate);
    if (!(as_is > kOtherWorld * aligned)) return;
    Warn("not aligned, the error is " + RoundedText(as_is, 4) + " m, and " +
             RoundedText(aligned, 4) + " m by se3: looks like another world frame",
         "--align");
  }

  void CheckLine() {
    const Alignment alignment = evaluation_.options.alignment;
    if (alignment != Alignment::kSe3 && alignment != Alignment::kSim3) return;
    Warn(std::string("its positions, or the reference's, lie on a line: the turn about it by ") +
             ToString(alignment) + " is arbitrary, and so are errors of orientation",
         "no alignment, --align-origin or --align-mode yaw for those");
  }

  void CheckOrientations(const Similarity& sim3) {
    const Trajectory& reference = evaluation_.reference;
    const Trajectory& estimate = evaluation_.estimate;
    const BodyTurn as_is = BodyTurnOf(reference, sim3 * estimate);
    const BodyTurn estimate_other =
        BodyTurnOf(reference, sim3 * estimate.WithOtherQuaternionOrder());
    const BodyTurn reference_other =
        BodyTurnOf(reference.WithOtherQuaternionOrder(), sim3 * estimate);
    const bool of_estimate = estimate_other.spread_deg <= reference_other.spread_deg;
    const double other = std::min(estimate_other.spread_deg, reference_other.spread_deg);
    if (as_is.spread_deg > kBodyTurnDeg && other < kClearly * as_is.spread_deg) {
      const Trajectory& wrong = of_estimate ? whole_estimate_ : whole_reference_;
      const bool w_first = wrong.format == TrajectoryFormat::kEuroc;
      warnings_.push_back(
          ErrorLine({wrong.name, wrong.first_line, 0}, {},
                    "the orientations fit to " + internal::FixedText(other, 1) +
                        " deg if quaternions are read w " + (w_first ? "last, to " : "first, to ") +
                        internal::FixedText(as_is.spread_deg, 1) + " deg as they are",
                    w_first ? "qw qx qy qz" : "qx qy qz qw"));
    } else if (as_is.turn_deg > kBodyTurnDeg && as_is.spread_deg < kClearly * as_is.turn_deg) {
      Warn("its orientations are turned by " + RoundedText(as_is.turn_deg, 4) +
               " deg, the same for all poses: looks like another body frame",
           "poses of the same body; its positions may be of another point too");
    }
  }

  const Evaluation& evaluation_;  ///< the estimate not aligned yet
  const Matches& matches_;
  const Trajectory& whole_reference_;
  const Trajectory& whole_estimate_;
  std::vector<std::string> warnings_;
};

}  // namespace

std::vector<std::string> internal::EvaluationWarnings(const Evaluation& evaluation,
                                                      const Matches& matches,
                                                      const Trajectory& reference,
                                                      const Trajectory& estimate) {
  return Warnings(evaluation, matches, reference, estimate).Take();
}

}  // namespace alidade
