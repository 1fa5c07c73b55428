// SPDX-License-Identifier: Apache-2.0
#include "alidade/evaluate/errors.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "alidade/base/error.h"
#include "alidade/base/number_text.h"
#include "alidade/base/statistics.h"
#include "alidade/evaluate/evaluate.h"

namespace alidade {
namespace {

constexpr double kHalfTurn = std::numbers::pi;

double AngleOf(const Eigen::Quaterniond& q) {
  return 2.0 * std::atan2(q.vec().norm(), std::abs(q.w()));
}

const Eigen::Quaterniond& Orientation(const Trajectory& trajectory, int i) {
  return trajectory.orientations[static_cast<std::size_t>(i)];
}

/// Error pose: the length of the translation and the angle of the rotation.
struct ErrorPose {
  double translation, angle;
};

double ErrorOf(PoseRelation relation, const ErrorPose& e) {
  switch (relation) {
    case PoseRelation::kRotation:
      return std::sqrt(8.0) * std::sin(0.5 * e.angle);
    case PoseRelation::kAngleDeg:
      return e.angle * 180.0 / kHalfTurn;
    case PoseRelation::kAngleRad:
      return e.angle;
    case PoseRelation::kFull:
      return std::hypot(std::sqrt(8.0) * std::sin(0.5 * e.angle), e.translation);
    case PoseRelation::kTranslation:
    case PoseRelation::kPointDistance:
      break;
  }
  return e.translation;
}

/// Returns the position of pose j in the frame of pose i.
Eigen::Vector3d RelativePosition(const Trajectory& t, int i, int j) {
  return Orientation(t, i).conjugate() * (t.positions.col(j) - t.positions.col(i));
}

ErrorPose RelativeError(const Trajectory& reference, const Trajectory& estimate, int i, int j) {
  const auto relative_rotation = [&](const Trajectory& t) {
    return Orientation(t, i).conjugate() * Orientation(t, j);
  };
  return {(RelativePosition(estimate, i, j) - RelativePosition(reference, i, j)).norm(),
          AngleOf(relative_rotation(reference).conjugate() * relative_rotation(estimate))};
}

/// Computes the distance of each pose from the first pose in frames, metres along the trajectory,
/// rad or ns. For degrees, the distances are in rad. For seconds, the distances are in ns, which
/// are exact.
std::vector<double> Progress(const Trajectory& t, DeltaUnit unit) {
  std::vector<double> progress = {0.0};
  for (int i = 1; i < t.size(); ++i) {
    const auto index = static_cast<std::size_t>(i);
    double step = 1.0;
    if (unit == DeltaUnit::kMetres) step = t.Length(i - 1, i);
    if (unit == DeltaUnit::kSeconds)
      step = static_cast<double>(t.timestamps[index] - t.timestamps[index - 1]);
    if (unit == DeltaUnit::kDegrees || unit == DeltaUnit::kRadians) {
      step = AngleOf(Orientation(t, i - 1).conjugate() * Orientation(t, i));
    }
    progress.push_back(progress.back() + step);
  }
  return progress;
}

using Pairs = std::vector<std::pair<int, int>>;

Pairs ConsecutivePairs(const std::vector<double>& progress, double delta, DeltaUnit unit) {
  Pairs pairs;
  int begin = unit == DeltaUnit::kMetres ? -1 : 0;  // -1: skip the first interval
  double begin_progress = 0.0;
  for (std::size_t j = 1; j < progress.size(); ++j) {
    if (!(progress[j] - begin_progress >= delta)) continue;
    if (begin >= 0) pairs.emplace_back(begin, static_cast<int>(j));
    begin = static_cast<int>(j);
    begin_progress = progress[j];
  }
  return pairs;
}

/// Returns a pair for each pose i. j is the later pose whose distance from i is nearest to delta.
/// If this distance is outside the tolerance, pose i has no pair.
Pairs AllPairs(const std::vector<double>& progress, double delta, double tolerance) {
  Pairs pairs;
  for (std::size_t i = 0; i + 1 < progress.size(); ++i) {
    const auto first = progress.begin() + static_cast<std::ptrdiff_t>(i) + 1;
    auto nearest = std::lower_bound(first, progress.end(), progress[i] + delta);
    const auto deviation = [&](auto iterator) { return std::abs(*iterator - progress[i] - delta); };
    if (nearest == progress.end() ||
        (nearest != first && deviation(nearest - 1) <= deviation(nearest))) {
      --nearest;
    }
    if (deviation(nearest) > tolerance) continue;
    pairs.emplace_back(static_cast<int>(i), static_cast<int>(nearest - progress.begin()));
  }
  return pairs;
}

/// Returns all pairs of poses whose relative rotation is within the tolerance of delta. Error:
/// kBadData if there are too many pairs.
Pairs AllAnglePairs(const Trajectory& t, double delta, double tolerance) {
  constexpr std::size_t kMaxPairs = 10'000'000;  // a body at rest could yield n (n - 1) / 2 pairs
  Pairs pairs;
  for (int i = 0; i < t.size(); ++i) {
    for (int j = i + 1; j < t.size(); ++j) {
      const double angle = AngleOf(Orientation(t, i).conjugate() * Orientation(t, j));
      if (std::abs(angle - delta) <= tolerance) pairs.emplace_back(i, j);
    }
    if (pairs.size() > kMaxPairs) {
      throw Error(
          ExitCode::kBadData,
          ErrorLine({t.name}, "--delta", "more than 10000000 pairs of poses have this rotation",
                    "a larger --delta, or a smaller --delta-tol"));
    }
  }
  return pairs;
}

}  // namespace

const char* ToString(PoseRelation relation) {
  constexpr const char* kNames[] = {"trans_part", "rot_part", "angle_deg",
                                    "angle_rad",  "full",     "point_distance"};
  return kNames[static_cast<std::size_t>(relation)];
}

const char* UnitOf(PoseRelation relation) {
  constexpr const char* kUnits[] = {"m", "", "deg", "rad", "", "m"};
  return kUnits[static_cast<std::size_t>(relation)];
}

const char* ToString(DeltaUnit unit) {
  constexpr const char* kNames[] = {"f", "m", "s", "d", "r"};
  return kNames[static_cast<std::size_t>(unit)];
}

ErrorStatistics StatisticsOf(std::vector<double> errors) {
  ALIDADE_EXPECTS(!errors.empty());
  const auto n = static_cast<double>(errors.size());
  std::ranges::sort(errors);
  ErrorStatistics s;
  s.min = errors.front();
  s.max = errors.back();
  s.median = 0.5 * (errors[(errors.size() - 1) / 2] + errors[errors.size() / 2]);
  s.mean = Mean(errors);
  for (const double e : errors) s.sse += e * e;
  s.rmse = std::sqrt(s.sse / n);
  s.std = std::sqrt(SquaredDeviation(errors) / n);
  return s;
}

Pairs PairsOf(const Trajectory& estimate, const PairOptions& options) {
  ALIDADE_EXPECTS(options.delta > 0.0 && options.tolerance >= 0.0);
  const auto fail = [&](const std::string& problem, const char* expected) {
    throw Error(ExitCode::kBadData, ErrorLine({estimate.name}, "--delta", problem, expected));
  };
  if (options.unit == DeltaUnit::kSeconds && !estimate.has_timestamps()) {
    fail("the unit is seconds, but the poses have no timestamps",
         "--delta-unit f or m, or a file times.txt in the same folder");
  }
  const bool degrees = options.unit == DeltaUnit::kDegrees;
  const bool angles = degrees || options.unit == DeltaUnit::kRadians;
  double delta = degrees ? options.delta * kHalfTurn / 180.0 : options.delta;
  if (options.unit == DeltaUnit::kSeconds) delta = std::round(1e9 * delta);
  const double tolerance = options.unit == DeltaUnit::kFrames ? 0.0 : options.tolerance * delta;
  Pairs pairs;
  if (options.all && angles) {
    pairs = AllAnglePairs(estimate, delta, tolerance);
  } else {
    const std::vector<double> progress = Progress(estimate, options.unit);
    pairs = options.all ? AllPairs(progress, delta, tolerance)
                        : ConsecutivePairs(progress, delta, options.unit);
  }
  if (pairs.empty()) {
    fail("no two of " + std::to_string(estimate.size()) + " poses are " +
             internal::NumberText(options.delta) + ' ' + ToString(options.unit) + " apart",
         "a smaller --delta, or a larger --delta-tol");
  }
  return pairs;
}

PoseErrors internal::AbsoluteErrors(PoseRelation relation, const Trajectory& reference,
                                    const Trajectory& estimate) {
  PoseErrors result{relation, {}, {}};
  for (int i = 0; i < estimate.size(); ++i) {
    result.errors.push_back(ErrorOf(
        relation, {(reference.positions.col(i) - estimate.positions.col(i)).norm(),
                   AngleOf(Orientation(estimate, i).conjugate() * Orientation(reference, i))}));
  }
  result.statistics = StatisticsOf(result.errors);
  return result;
}

PoseErrors internal::RelativeErrors(PoseRelation relation, const Trajectory& reference,
                                    const Trajectory& estimate, const Pairs& pairs) {
  PoseErrors result{relation, {}, {}};
  const auto distance = [](const Trajectory& t, int i, int j) {
    return (t.positions.col(j) - t.positions.col(i)).norm();
  };
  for (const auto& [i, j] : pairs) {
    result.errors.push_back(relation == PoseRelation::kPointDistance
                                ? std::abs(distance(reference, i, j) - distance(estimate, i, j))
                                : ErrorOf(relation, RelativeError(reference, estimate, i, j)));
  }
  result.statistics = StatisticsOf(result.errors);
  return result;
}

}  // namespace alidade
