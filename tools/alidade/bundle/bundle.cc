// SPDX-License-Identifier: Apache-2.0
#include "alidade/bundle/bundle.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <optional>
#include <set>

#include "alidade/base/text.h"
#include "alidade/plugin/load.h"

namespace alidade {
namespace {

[[noreturn]] void FailRoles(const SensorModel& sensor, const std::string& why) {
  throw Error(ExitCode::kInternal,
              ErrorLine({}, {}, "sensor '" + sensor.name() + "' cannot adjust a bundle: " + why));
}

/// Cameras and points joined by the observations used, as trees: the root of each.
class Parts {
 public:
  explicit Parts(const BundleProblem& problem)
      : cameras_(problem.cameras.size()), root_(cameras_ + problem.points.size()) {
    std::iota(root_.begin(), root_.end(), std::size_t{0});
    for (const BundleObservation& seen : problem.observations) {
      if (!seen.used) continue;
      const std::size_t camera = Root(static_cast<std::size_t>(seen.camera));
      root_[camera] = Root(cameras_ + static_cast<std::size_t>(seen.point));
    }
    for (const BundleObservation& seen : problem.observations) {
      if (seen.used) roots_.insert(Root(static_cast<std::size_t>(seen.camera)));
    }
  }
  std::size_t count() const { return roots_.size(); }

 private:
  std::size_t Root(std::size_t i) {
    while (root_[i] != i) i = root_[i] = root_[root_[i]];
    return i;
  }
  std::size_t cameras_;
  std::vector<std::size_t> root_;
  std::set<std::size_t> roots_;
};

/// |z (-) h|^2; none where h is not defined, or where that is not finite.
std::optional<double> SquaredError(const SensorModel& sensor, const BundleRoles& roles,
                                   const BundleProblem& problem, const BundleObservation& seen) {
  double h[4], d[4], sum = 0.0;
  if (sensor.Predict(RoleValues(roles, problem, seen).data(), h) != Status::kOk)
    return std::nullopt;
  const Geometry& geometry = sensor.measurement().geometry;
  geometry.Minus(seen.z.data(), h, d);
  for (int i = 0; i < geometry.tangent; ++i) sum += d[i] * d[i];
  return std::isfinite(sum) ? std::optional(sum) : std::nullopt;
}

/// The first camera that is used, and what the scale is measured by: BundleResult::extent_before.
class Gauge {
 public:
  explicit Gauge(const BundleProblem& problem)
      : cameras_(problem.cameras.size()), points_(problem.points.size()) {
    for (const BundleObservation& seen : problem.observations) {
      if (!seen.used) continue;
      cameras_[static_cast<std::size_t>(seen.camera)] = true;
      points_[static_cast<std::size_t>(seen.point)] = true;
    }
    first_ = static_cast<std::size_t>(std::ranges::find(cameras_, true) - cameras_.begin());
    by_points_ = !(Extent(problem) > 0.0);
  }
  double Extent(const BundleProblem& problem) const {
    const std::array<double, 3> eye = problem.cameras[first_].position;
    std::vector<double> distances;
    const auto add = [&](const std::array<double, 3>& x) {
      distances.push_back(std::hypot(x[0] - eye[0], x[1] - eye[1], x[2] - eye[2]));
    };
    for (std::size_t i = first_ + 1; !by_points_ && i < cameras_.size(); ++i) {
      if (cameras_[i]) add(problem.cameras[i].position);
    }
    for (std::size_t i = 0; by_points_ && i < points_.size(); ++i) {
      if (points_[i]) add(problem.points[i]);
    }
    if (distances.empty()) return 0.0;
    const auto middle = distances.begin() + std::ssize(distances) / 2;
    std::ranges::nth_element(distances, middle);
    return *middle;
  }
  /// Scales what is used about the first camera. No pixel changes.
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
  std::vector<bool> cameras_, points_;  ///< those used
  std::size_t first_ = 0;
  bool by_points_ = false;  ///< the other cameras stand where the first does, or are none
};

/// Two numbers of a camera: nothing of the scale.
bool TellsNoScale(const SensorModel& sensor) { return sensor.measurement().geometry.tangent < 3; }

/// Five digits and more would say nothing to a reader.
std::string Short(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.5g", value);
  return text;
}

/// `1 point is`, `3 points are`
std::string Count(std::ptrdiff_t count, const std::string& what) {
  return std::to_string(count) + ' ' + what + (count == 1 ? " is" : "s are");
}

}  // namespace

const char* ToString(BundleEnd end) {
  constexpr const char* kNames[] = {"converged", "out_of_iterations", "stopped", "failed"};
  return kNames[static_cast<int>(end)];
}

BundleRoles RolesOf(const SensorModel& sensor) {
  constexpr std::size_t kNone = SIZE_MAX;
  BundleRoles found{kNone, kNone, kNone};
  for (std::size_t i = 0; i < sensor.roles().size(); ++i) {
    const Space& role = sensor.roles()[i];
    if (role.name == "position") {
      found.position = i;
    } else if (role.name == "orientation") {
      found.orientation = i;
    } else if (role.name == "intrinsics") {
      found.intrinsics = static_cast<int>(i);
    } else if (found.point == kNone && role.geometry == Geometry::Vector(3)) {
      found.point = i;
    } else {
      FailRoles(sensor, "it has the role '" + role.name + "' too");
    }
  }
  if (std::max({found.position, found.orientation, found.point}) == kNone)
    FailRoles(sensor, "it lacks one of position, orientation and a point");
  const Geometry& z = sensor.measurement().geometry;
  if (z.kind != GeometryKind::kVector || z.ambient > 4)
    FailRoles(sensor, "it measures " + ToString(z));
  if (sensor.known_size() > 0) FailRoles(sensor, "it takes known numbers with each measurement");
  return found;
}

std::vector<const double*> RoleValues(const BundleRoles& roles, const BundleProblem& problem,
                                      const BundleObservation& seen) {
  const BundleCamera& camera = problem.cameras[static_cast<std::size_t>(seen.camera)];
  std::vector<const double*> values(roles.intrinsics < 0 ? 3 : 4);
  values[roles.position] = camera.position.data();
  values[roles.orientation] = camera.orientation.data();
  values[roles.point] = problem.points[static_cast<std::size_t>(seen.point)].data();
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
      throw Error(ExitCode::kUsage,
                  ErrorLine({}, "--fix", '\'' + name + "' cannot be fixed",
                            "intrinsics: sensor '" + sensor.name() + "' estimates none"));
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
    const auto at = std::ranges::find(lens.elements, name);
    if (at == lens.elements.end()) {
      throw Error(ExitCode::kUsage, ErrorLine({}, "--fix", '\'' + name + "' cannot be fixed",
                                              "intrinsics, or of " + internal::Join(lens.elements),
                                              Nearest(name, lens.elements)));
    }
    elements[static_cast<std::size_t>(at - lens.elements.begin())] = true;
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

int LeaveOutUndefined(const SensorModel& sensor, BundleProblem& problem) {
  const BundleRoles roles = RolesOf(sensor);
  int left_out = 0;
  for (BundleObservation& seen : problem.observations) {
    seen.used = SquaredError(sensor, roles, problem, seen).has_value();
    left_out += seen.used ? 0 : 1;
  }
  return left_out;
}

double BundleRms(const SensorModel& sensor, const BundleProblem& problem) {
  const BundleRoles roles = RolesOf(sensor);
  double sum = 0.0, count = 0.0;
  for (const BundleObservation& seen : problem.observations) {
    const auto error = seen.used ? SquaredError(sensor, roles, problem, seen) : std::nullopt;
    if (!error) continue;
    sum += *error;
    count += 1.0;
  }
  return count > 0.0 ? std::sqrt(sum / count) : 0.0;
}

BundleResult AdjustBundle(const SensorModel& sensor, BundleProblem& problem,
                          const BundleOptions& options, const std::filesystem::path& folder) {
  if (std::ranges::none_of(problem.observations, &BundleObservation::used))
    throw Error(ExitCode::kBadData, ErrorLine({}, {}, "no observation can be used"));
  const double scale = options.loss.scale;
  if (options.loss.kind != LossKind::kNone &&
      !(scale >= kBundleLossScaleMin && scale <= kBundleLossScaleMax)) {
    throw Error(ExitCode::kUsage,
                ErrorLine({}, "the scale of the loss", Short(scale) + " is out of bounds",
                          Short(kBundleLossScaleMin) + " to " + Short(kBundleLossScaleMax) +
                              " standard deviations"));
  }
  const void* const factory = internal::FactoryOnDemand(
      kBundleAdjusterKind, "bundle", folder,
      ErrorLine({}, {}, "this build of alidade adjusts no bundles",
                "one that found the Ceres solver: apt-get install libceres-dev, then configure and "
                "build again"));
  const Gauge gauge(problem);
  const double extent = gauge.Extent(problem);
  BundleResult result =
      static_cast<const BundleAdjusterEntry*>(factory)->adjust(sensor, problem, options);
  const double factor = extent / gauge.Extent(problem);
  if (TellsNoScale(sensor) && factor > 0.0 && factor != 1.0 && std::isfinite(factor))
    gauge.Scale(factor, problem);
  result.extent_before = extent;
  result.extent_after = gauge.Extent(problem);
  return result;
}

std::vector<std::string> Undetermined(const BundleProblem& problem, const SensorModel& sensor,
                                      const BundleResult& result) {
  std::vector<std::string> lines;
  const bool mono = TellsNoScale(sensor);
  lines.emplace_back(mono ? "gauge: the pose of the first camera and the scale are constant"
                          : "gauge: the pose of the first camera is constant");
  if (result.extent_before > 0.0) {
    lines.push_back("extent: " + Short(result.extent_before) + " -> " + Short(result.extent_after) +
                    ", median distance from the first camera");
  }
  std::vector<int> seen_by(problem.points.size()), sees(problem.cameras.size());
  for (const BundleObservation& seen : problem.observations) {
    if (!seen.used) continue;
    ++seen_by[static_cast<std::size_t>(seen.point)];
    ++sees[static_cast<std::size_t>(seen.camera)];
  }
  const auto unseen = std::ranges::count(seen_by, 0), blind = std::ranges::count(sees, 0);
  const auto once = std::ranges::count(seen_by, 1);
  if (blind > 0)
    lines.push_back(Count(blind, "camera") + " without observations, and left as read");
  if (unseen > 0) lines.push_back(Count(unseen, "point") + " seen by no camera, and left as read");
  if (mono && once > 0) lines.push_back(Count(once, "point") + " seen once: no depth");
  if (const std::size_t parts = Parts(problem).count(); parts > 1) {
    lines.push_back(std::to_string(parts) +
                    " parts share no observation: each floats by itself, but the first");
  }
  const int scale = mono ? 1 : 0;
  const int open = result.unknowns - scale - result.rank;
  if (result.rank < 0) {
    lines.emplace_back(result.unknowns > kBundleRankUnknowns
                           ? "rank: not computed of more than " +
                                 std::to_string(kBundleRankUnknowns) + " unknowns"
                           : "rank: not computed, the Jacobian is not finite");
  } else if (open > 0) {
    lines.push_back("rank: " + std::to_string(result.rank) + " of " +
                    std::to_string(result.unknowns) + " unknowns; " + std::to_string(open) +
                    (open == 1 ? " direction" : " directions") +
                    (mono ? " besides the scale" : "") + (open == 1 ? " is" : " are") +
                    " determined by no observation");
  } else {
    lines.push_back(
        "rank: " + std::to_string(result.rank) + " of " + std::to_string(result.unknowns) +
        " unknowns: " + (mono ? "all but the scale is determined" : "all is determined"));
  }
  return lines;
}

}  // namespace alidade
