// SPDX-License-Identifier: Apache-2.0
#include "alidade/bundle/bundle.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>
#include <optional>
#include <set>

#include "alidade/base/text.h"
#include "alidade/plugin/load.h"

namespace alidade {
namespace {

[[noreturn]] void FailRoles(const SensorModel& sensor, const std::string& reason) {
  throw Error(
      ExitCode::kInternal,
      ErrorLine({}, {},
                "sensor '" + sensor.name() + "' cannot be used in a bundle adjustment: " + reason));
}

/// Connected components of the graph whose nodes are cameras and points and whose edges are the
/// used observations. The components are computed with a union-find forest.
class Components {
 public:
  explicit Components(const BundleProblem& problem)
      : cameras_(problem.cameras.size()), parents_(cameras_ + problem.points.size()) {
    std::iota(parents_.begin(), parents_.end(), std::size_t{0});
    for (const BundleObservation& observation : problem.observations) {
      if (!observation.used) continue;
      const std::size_t camera = Root(static_cast<std::size_t>(observation.camera));
      parents_[camera] = Root(cameras_ + static_cast<std::size_t>(observation.point));
    }
    for (const BundleObservation& observation : problem.observations) {
      if (observation.used) roots_.insert(Root(static_cast<std::size_t>(observation.camera)));
    }
  }
  std::size_t count() const { return roots_.size(); }

 private:
  std::size_t Root(std::size_t i) {
    while (parents_[i] != i) i = parents_[i] = parents_[parents_[i]];
    return i;
  }
  std::size_t cameras_;
  std::vector<std::size_t> parents_;
  std::set<std::size_t> roots_;
};

using Residual = std::array<double, 4>;

/// Computes z (-) h. The elements beyond the size of z are NaN. Returns nullopt if h is undefined
/// or |z (-) h|^2 is not finite.
std::optional<Residual> ResidualOf(const SensorModel& sensor, const BundleRoles& roles,
                                   const BundleProblem& problem,
                                   const BundleObservation& observation) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  double h[4];
  if (sensor.Predict(RoleValues(roles, problem, observation).data(), h) != Status::kOk)
    return std::nullopt;
  const Geometry& geometry = sensor.measurement().geometry;
  Residual residual = {kNone, kNone, kNone, kNone};
  geometry.Minus(observation.z.data(), h, residual.data());
  double sum = 0.0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(geometry.tangent); ++i) {
    sum += residual[i] * residual[i];
  }
  return std::isfinite(sum) ? std::optional(residual) : std::nullopt;
}

/// Gauge of a problem: the first used camera, and the extent as in BundleResult::extent_before.
class Gauge {
 public:
  explicit Gauge(const BundleProblem& problem)
      : cameras_(problem.cameras.size()), points_(problem.points.size()) {
    for (const BundleObservation& observation : problem.observations) {
      if (!observation.used) continue;
      cameras_[static_cast<std::size_t>(observation.camera)] = true;
      points_[static_cast<std::size_t>(observation.point)] = true;
    }
    first_ = static_cast<std::size_t>(std::ranges::find(cameras_, true) - cameras_.begin());
    uses_points_ = !(Extent(problem) > 0.0);
  }
  double Extent(const BundleProblem& problem) const {
    const std::array<double, 3> eye = problem.cameras[first_].position;
    std::vector<double> distances;
    const auto add = [&](const std::array<double, 3>& x) {
      distances.push_back(std::hypot(x[0] - eye[0], x[1] - eye[1], x[2] - eye[2]));
    };
    for (std::size_t i = first_ + 1; !uses_points_ && i < cameras_.size(); ++i) {
      if (cameras_[i]) add(problem.cameras[i].position);
    }
    for (std::size_t i = 0; uses_points_ && i < points_.size(); ++i) {
      if (points_[i]) add(problem.points[i]);
    }
    if (distances.empty()) return 0.0;
    const auto median = distances.begin() + std::ssize(distances) / 2;
    std::ranges::nth_element(distances, median);
    return *median;
  }
  /// Scales the used cameras and points about the first camera. The predicted pixels do not change.
  void Scale(double factor, BundleProblem& problem) const {
    const std::array<double, 3> eye = problem.cameras[first_].position;
    const auto scale = [&](std::array<double, 3>& x) {
      for (std::size_t k = 0; k < 3; ++k) x[k] = eye[k] + factor * (x[k] - eye[k]);
    };
    for (std::size_t i = first_ + 1; i < cameras_.size(); ++i) {
      if (cameras_[i]) scale(problem.cameras[i].position);
    }
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (points_[i]) scale(problem.points[i]);
    }
  }

 private:
  std::vector<bool> cameras_, points_;  ///< true: an observation uses the camera or point
  std::size_t first_ = 0;
  bool uses_points_ = false;  ///< true: Extent() uses the points, not the cameras
};

/// Returns true if the sensor measures at most two numbers, which do not determine the scale.
bool LacksScale(const SensorModel& sensor) { return sensor.measurement().geometry.tangent < 3; }

/// Formats a number with five digits.
std::string ShortText(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.5g", value);
  return text;
}

/// Returns a count with a noun and a verb, as in `1 point is` or `3 points are`.
std::string Count(std::ptrdiff_t count, const std::string& noun) {
  return std::to_string(count) + ' ' + noun + (count == 1 ? " is" : "s are");
}

}  // namespace

const char* ToString(BundleEnd end) {
  constexpr const char* kNames[] = {"converged", "out_of_iterations", "stopped", "failed"};
  return kNames[static_cast<int>(end)];
}

BundleRoles RolesOf(const SensorModel& sensor) {
  constexpr std::size_t kNone = SIZE_MAX;
  BundleRoles roles{kNone, kNone, kNone};
  for (std::size_t i = 0; i < sensor.roles().size(); ++i) {
    const Space& role = sensor.roles()[i];
    if (role.name == "position") {
      roles.position = i;
    } else if (role.name == "orientation") {
      roles.orientation = i;
    } else if (role.name == "intrinsics") {
      roles.intrinsics = static_cast<int>(i);
    } else if (roles.point == kNone && role.geometry == Geometry::Vector(3)) {
      roles.point = i;
    } else {
      FailRoles(sensor, "it has the additional role '" + role.name + "'");
    }
  }
  if (std::max({roles.position, roles.orientation, roles.point}) == kNone)
    FailRoles(sensor, "it does not have the roles position, orientation and a point");
  const Geometry& z = sensor.measurement().geometry;
  if (!z.is_vector() || z.ambient > 4) FailRoles(sensor, "it measures " + ToString(z));
  if (sensor.known_size() > 0) FailRoles(sensor, "it needs known numbers with each measurement");
  return roles;
}

std::vector<const double*> RoleValues(const BundleRoles& roles, const BundleProblem& problem,
                                      const BundleObservation& observation) {
  const BundleCamera& camera = problem.cameras[static_cast<std::size_t>(observation.camera)];
  std::vector<const double*> values(roles.intrinsics < 0 ? 3 : 4);
  values[roles.position] = camera.position.data();
  values[roles.orientation] = camera.orientation.data();
  values[roles.point] = problem.points[static_cast<std::size_t>(observation.point)].data();
  if (roles.intrinsics >= 0) {
    values[static_cast<std::size_t>(roles.intrinsics)] =
        problem.intrinsics[static_cast<std::size_t>(camera.intrinsics)].data();
  }
  return values;
}

std::vector<bool> FixedElements(const SensorModel& sensor, const std::vector<std::string>& fixed) {
  const BundleRoles roles = RolesOf(sensor);
  if (roles.intrinsics < 0) {
    for (const std::string& name : fixed) {
      if (name == "intrinsics") continue;
      throw Error(ExitCode::kUsage, ErrorLine({}, "--fix",
                                              '\'' + name + "' cannot be fixed: sensor '" +
                                                  sensor.name() + "' does not estimate intrinsics",
                                              "'intrinsics', or no option --fix"));
    }
    return {};
  }
  const Space& lens = sensor.roles()[static_cast<std::size_t>(roles.intrinsics)];
  std::vector<bool> elements(lens.elements.size());
  for (const std::string& name : fixed) {
    if (name == lens.name) {
      elements.assign(elements.size(), true);
      continue;
    }
    const auto element = std::ranges::find(lens.elements, name);
    if (element == lens.elements.end()) {
      throw Error(ExitCode::kUsage, ErrorLine({}, "--fix", '\'' + name + "' cannot be fixed",
                                              "intrinsics, or " + internal::Join(lens.elements),
                                              Nearest(name, lens.elements)));
    }
    elements[static_cast<std::size_t>(element - lens.elements.begin())] = true;
  }
  return elements;
}

SharedSensor BundleSensor(const PluginHost& host, const BundleProblem& problem) {
  const Config config = Config::FromText(problem.sensor, "sensor of the bundle");
  const SharedSensor sensor =
      host.CreateSensor(config.root().At("model").Text(), config.root(), "xyz");
  config.root().RejectUnread();
  return sensor;
}

int ExcludeUndefined(const SensorModel& sensor, BundleProblem& problem) {
  const BundleRoles roles = RolesOf(sensor);
  int excluded = 0;
  for (BundleObservation& observation : problem.observations) {
    observation.used = ResidualOf(sensor, roles, problem, observation).has_value();
    excluded += observation.used ? 0 : 1;
  }
  return excluded;
}

std::vector<std::array<double, 4>> BundleResiduals(const SensorModel& sensor,
                                                   const BundleProblem& problem) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const BundleRoles roles = RolesOf(sensor);
  std::vector<Residual> residuals(problem.observations.size(), {kNone, kNone, kNone, kNone});
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    const BundleObservation& observation = problem.observations[i];
    const auto residual =
        observation.used ? ResidualOf(sensor, roles, problem, observation) : std::nullopt;
    if (residual) residuals[i] = *residual;
  }
  return residuals;
}

double BundleRms(const SensorModel& sensor, const BundleProblem& problem) {
  double sum = 0.0, count = 0.0;
  for (const Residual& residual : BundleResiduals(sensor, problem)) {
    if (std::isnan(residual[0])) continue;
    for (const double element : residual) sum += std::isnan(element) ? 0.0 : element * element;
    count += 1.0;
  }
  return count > 0.0 ? std::sqrt(sum / count) : 0.0;
}

BundleResult AdjustBundle(const SensorModel& sensor, BundleProblem& problem,
                          const BundleOptions& options, const std::filesystem::path& folder) {
  if (std::ranges::none_of(problem.observations, &BundleObservation::used))
    throw Error(ExitCode::kBadData,
                ErrorLine({}, {}, "the problem does not contain a usable observation"));
  const double scale = options.loss.scale;
  if (options.loss.kind != LossKind::kNone &&
      !(scale >= kBundleLossScaleMin && scale <= kBundleLossScaleMax)) {
    throw Error(ExitCode::kUsage,
                ErrorLine({}, "scale of the loss", ShortText(scale) + " is out of bounds",
                          ShortText(kBundleLossScaleMin) + " to " + ShortText(kBundleLossScaleMax) +
                              " standard deviations"));
  }
  const void* const factory = internal::FactoryOnDemand(
      kBundleAdjusterKind, "bundle", folder,
      ErrorLine({}, {}, "this build of alidade does not include bundle adjustment",
                "a build with the Ceres solver: apt-get install libceres-dev, then configure and "
                "build again"));
  const Gauge gauge(problem);
  const double extent = gauge.Extent(problem);
  BundleResult result =
      static_cast<const BundleAdjusterEntry*>(factory)->adjust(sensor, problem, options);
  const double factor = extent / gauge.Extent(problem);
  if (LacksScale(sensor) && factor > 0.0 && factor != 1.0 && std::isfinite(factor))
    gauge.Scale(factor, problem);
  result.extent_before = extent;
  result.extent_after = gauge.Extent(problem);
  return result;
}

std::vector<std::string> DescribeUndetermined(const BundleProblem& problem,
                                              const SensorModel& sensor,
                                              const BundleResult& result) {
  std::vector<std::string> lines;
  const bool mono = LacksScale(sensor);
  lines.emplace_back(mono ? "gauge: the pose of the first camera and the scale are constant"
                          : "gauge: the pose of the first camera is constant");
  if (result.extent_before > 0.0) {
    lines.push_back("extent: " + ShortText(result.extent_before) + " -> " +
                    ShortText(result.extent_after) + ", median distance from the first camera");
  }
  std::vector<int> seen_by(problem.points.size()), sees(problem.cameras.size());
  for (const BundleObservation& observation : problem.observations) {
    if (!observation.used) continue;
    ++seen_by[static_cast<std::size_t>(observation.point)];
    ++sees[static_cast<std::size_t>(observation.camera)];
  }
  const auto unseen = std::ranges::count(seen_by, 0), blind = std::ranges::count(sees, 0);
  const auto seen_once = std::ranges::count(seen_by, 1);
  if (blind > 0) lines.push_back(Count(blind, "camera") + " unchanged for lack of observations");
  if (unseen > 0) lines.push_back(Count(unseen, "point") + " unchanged: not seen by any camera");
  if (mono && seen_once > 0)
    lines.push_back(Count(seen_once, "point") + " seen only once: the depth is undetermined");
  if (const std::size_t components = Components(problem).count(); components > 1) {
    lines.push_back("cameras and points form " + std::to_string(components) +
                    " separate components, whose relative poses are undetermined");
  }
  const int scale = mono ? 1 : 0;
  const int undetermined = result.unknowns - scale - result.rank;
  if (result.rank < 0) {
    lines.emplace_back(result.unknowns > kBundleRankUnknowns
                           ? "rank: not computed (more than " +
                                 std::to_string(kBundleRankUnknowns) + " unknowns)"
                           : "rank: not computed (the Jacobian is not finite)");
  } else if (undetermined > 0) {
    lines.push_back("rank: " + std::to_string(result.rank) + " of " +
                    std::to_string(result.unknowns) + " unknowns; " + std::to_string(undetermined) +
                    (undetermined == 1 ? " direction" : " directions") +
                    (mono ? " besides the scale" : "") + (undetermined == 1 ? " is" : " are") +
                    " undetermined");
  } else {
    lines.push_back(
        "rank: " + std::to_string(result.rank) + " of " + std::to_string(result.unknowns) +
        " unknowns: " + (mono ? "all are determined except the scale" : "all are determined"));
  }
  return lines;
}

}  // namespace alidade
