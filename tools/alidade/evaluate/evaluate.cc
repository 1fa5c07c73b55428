// SPDX-License-Identifier: Apache-2.0
#include "alidade/evaluate/evaluate.h"

#include <algorithm>
#include <cmath>

#include "alidade/base/error.h"
#include "alidade/base/statistics.h"
#include "alidade/evaluate/errors.h"
#include "alidade/evaluate/warnings.h"
#include "alidade/model/geometry.h"
#include "alidade/state/dense_algebra.h"

namespace alidade {
namespace {

/// Returns the axes with a positive variance in at least one pose. A planar pose has fewer than 3
/// such axes.
std::vector<int> UncertainAxes(const std::vector<Eigen::Matrix3d>& covariances) {
  std::vector<int> axes;
  for (int axis = 0; axis < 3; ++axis) {
    const auto uncertain = [axis](const Eigen::Matrix3d& c) { return c(axis, axis) > 0.0; };
    if (std::ranges::any_of(covariances, uncertain)) axes.push_back(axis);
  }
  return axes;
}

/// Computes the NEES. Column i of `errors` belongs to covariance i.
Nees NeesOf(const Eigen::Matrix3Xd& errors, const std::vector<Eigen::Matrix3d>& covariances) {
  const std::vector<int> axes = UncertainAxes(covariances);
  Nees nees;
  if (axes.empty()) return nees;
  nees.dof = static_cast<int>(axes.size());
  const double limit = ChiSquareQuantile(0.95, nees.dof);
  double sum = 0.0, inside = 0.0;
  for (std::size_t i = 0; i < covariances.size(); ++i) {
    const Eigen::Vector3d error = errors.col(static_cast<Eigen::Index>(i));
    const double squared = internal::SquaredMahalanobis(covariances[i](axes, axes), error(axes));
    if (std::isnan(squared)) continue;
    ++nees.poses;
    sum += squared / nees.dof;
    inside += squared <= limit ? 1.0 : 0.0;
  }
  nees.mean = sum / nees.poses;
  nees.within95 = inside / nees.poses;
  return nees;
}

/// Computes d = q_true (-) q of each pose, in the body frame, rad.
Eigen::Matrix3Xd OrientationErrors(const Trajectory& reference, const Trajectory& estimate) {
  Eigen::Matrix3Xd errors(3, estimate.size());
  for (int i = 0; i < estimate.size(); ++i) {
    const auto stored = [i](const Trajectory& t) {
      const Eigen::Quaterniond& q = t.orientations[static_cast<std::size_t>(i)];
      return Eigen::Vector4d(q.w(), q.x(), q.y(), q.z());
    };
    const Eigen::Vector4d truth = stored(reference), estimated = stored(estimate);
    UnitQuaternion::Minus(truth.data(), estimated.data(), errors.col(i).data());
  }
  return errors;
}

/// Adds the NEES of the estimate, which is neither aligned nor projected yet.
void AddNees(Evaluation& evaluation) {
  const Trajectory& estimate = evaluation.estimate;
  if (!estimate.has_covariances()) return;
  const EvaluateOptions& options = evaluation.options;
  if (options.alignment != Alignment::kNone || options.plane != Plane::kNone) {
    const bool is_aligned = options.alignment != Alignment::kNone;
    evaluation.nees_withheld = is_aligned
                                   ? std::string("the alignment by ") + ToString(options.alignment)
                                   : std::string("the projection to ") + ToString(options.plane);
    evaluation.nees_withheld +=
        " removes part of the error that the covariance describes; for the NEES, omit the ";
    evaluation.nees_withheld += is_aligned ? "alignment" : "projection";
    return;
  }
  const auto add = [&](const char* quantity, const Nees& nees, std::optional<Nees>& result) {
    if (nees.poses > 0) {
      result = nees;
      return;
    }
    std::string& withheld = evaluation.nees_withheld;
    withheld += std::string(withheld.empty() ? "" : "; ") + "every covariance of the " + quantity +
                " is singular";
  };
  add("position",
      NeesOf(evaluation.reference.positions - estimate.positions, estimate.position_covariances),
      evaluation.position_nees);
  add("orientation",
      NeesOf(OrientationErrors(evaluation.reference, estimate), estimate.orientation_covariances),
      evaluation.orientation_nees);
}

std::optional<double> ScaleOf(const Trajectory& reference, const Trajectory& estimate) {
  const auto found = internal::FindSimilarity(estimate.positions, reference.positions);
  return found ? std::optional(found->scale) : std::nullopt;
}

/// Computes (scale of the second half) / (scale of the first half) - 1.
std::optional<double> ScaleDrift(const Trajectory& reference, const Trajectory& estimate) {
  constexpr int kMinPoses = 10;
  std::vector<int> halves[2];
  for (int i = 0; i < estimate.size(); ++i) halves[2 * i < estimate.size() ? 0 : 1].push_back(i);
  if (std::ssize(halves[1]) < kMinPoses) return std::nullopt;
  const auto scale = [&](const std::vector<int>& half) {
    return ScaleOf(reference.Select(half), estimate.Select(half));
  };
  const auto first = scale(halves[0]), second = scale(halves[1]);
  if (!first || !second) return std::nullopt;
  return *second / *first - 1.0;
}

/// Returns the number of poses of the estimate that can match the range of the reference.
int PosesNear(const EvaluateOptions& options, const Trajectory& estimate) {
  if (options.range.is_unlimited() || !estimate.has_timestamps()) return estimate.size();
  const double margin_s = Seconds(options.max_diff);
  const auto is_near = [&](Timestamp timestamp) {
    const double t_s = Seconds(timestamp) + Seconds(options.offset);
    return (!options.range.start || t_s >= Seconds(*options.range.start) - margin_s) &&
           (!options.range.end || t_s <= Seconds(*options.range.end) + margin_s);
  };
  return static_cast<int>(std::ranges::count_if(estimate.timestamps, is_near));
}

}  // namespace

Evaluation Evaluate(const Trajectory& whole_reference, const Trajectory& whole_estimate,
                    const EvaluateOptions& options) {
  const Trajectory reference = Crop(Downsample(whole_reference, options.downsample), options.range);
  const Trajectory estimate = Downsample(whole_estimate, options.downsample);
  Matches matches = Associate(reference, estimate, options.max_diff, options.offset);
  matches.possible = std::min(matches.possible, PosesNear(options, estimate));
  Evaluation evaluation;
  evaluation.label = estimate.name;
  evaluation.options = options;
  evaluation.possible = matches.possible;
  evaluation.by_row = matches.by_row;
  evaluation.reference = reference.Select(matches.reference);
  evaluation.estimate = estimate.Select(matches.estimate);
  evaluation.sim3_scale = ScaleOf(evaluation.reference, evaluation.estimate);
  evaluation.scale_drift = ScaleDrift(evaluation.reference, evaluation.estimate);
  evaluation.alignment =
      Align(options.alignment, evaluation.reference, evaluation.estimate, options.align_poses);
  evaluation.warnings = internal::EvaluationWarnings(evaluation, matches, reference, estimate);
  AddNees(evaluation);
  if (options.alignment != Alignment::kNone) {
    evaluation.estimate = evaluation.alignment * evaluation.estimate;
  }
  evaluation.reference = Project(evaluation.reference, options.plane);
  evaluation.estimate = Project(evaluation.estimate, options.plane);
  for (const PoseRelation relation : options.relations) {
    evaluation.absolute.push_back(
        internal::AbsoluteErrors(relation, evaluation.reference, evaluation.estimate));
  }
  if (evaluation.estimate.size() < 2) return evaluation;
  try {
    evaluation.pairs = PairsOf(evaluation.estimate, options.pairs);
  } catch (const Error& error) {  // the other results are still valid
    evaluation.warnings.emplace_back(error.what());
    return evaluation;
  }
  for (const PoseRelation relation : options.relations) {
    evaluation.relative.push_back(internal::RelativeErrors(relation, evaluation.reference,
                                                           evaluation.estimate, evaluation.pairs));
  }
  return evaluation;
}

}  // namespace alidade
