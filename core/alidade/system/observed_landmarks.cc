// SPDX-License-Identifier: Apache-2.0
#include "alidade/system/observed_landmarks.h"

#include <algorithm>
#include <string>

#include "alidade/model/geometry.h"
#include "alidade/system/landmark_forms.h"

namespace alidade {
namespace {

/// Where the landmarks are before the camera, as shares of their usual distance.
constexpr double kPlaces[][3] = {{-0.2, 0.1, 1.0},   {0.23, -0.07, 1.3}, {0.1, 0.15, 0.8},
                                 {-0.1, -0.12, 1.6}, {0.02, 0.05, 2.1},  {0.17, 0.11, 1.15}};

/// The sensor's model for landmarks of the representation xyz; null where it has none.
const SensorModel* XyzModel(const SensorBinding& sensor) {
  if (RepresentationOf(sensor.model.roles()) == internal::XyzRepresentation()) return &sensor.model;
  return sensor.xyz ? &*sensor.xyz : nullptr;
}

/// The block in the role of that name; -1 where there is none.
BlockId BlockIn(const SensorBinding& sensor, const char* role) {
  for (std::size_t i = 0; i < sensor.roles.size(); ++i) {
    if (sensor.model.roles()[i].name == role) return sensor.roles[i].block;
  }
  return -1;
}

/// Where the block starts, else `otherwise`.
std::vector<double> StartOf(const System& system, BlockId block,
                            const std::vector<double>& otherwise) {
  const auto prior = std::ranges::find(system.priors, block, &Prior::block);
  const bool fits = prior != system.priors.end() && prior->mean.size() == otherwise.size();
  return fits ? prior->mean : otherwise;
}

/// The sensor as it sees the one landmark `block`.
SensorBinding SeenAs(const SensorBinding& sensor, BlockId block) {
  SensorBinding binding{sensor.name, sensor.stream, *XyzModel(sensor), {}};
  for (std::size_t i = 0; i < sensor.roles.size(); ++i) {
    if (!sensor.model.roles()[i].landmark()) binding.roles.push_back(sensor.roles[i]);
  }
  binding.roles.push_back({block});
  return binding;
}

}  // namespace

std::optional<internal::WithLandmarks> internal::PlaceLandmarks(const System& system) {
  const auto sees = [](const SensorBinding& sensor) { return sensor.model.has_landmark(); };
  const auto blind = [&](const SensorBinding& s) { return sees(s) && XyzModel(s) == nullptr; };
  const auto first = std::ranges::find_if(system.sensors, sees);
  if (!system.landmarks || first == system.sensors.end() ||
      std::ranges::any_of(system.sensors, blind)) {
    return std::nullopt;
  }
  const std::size_t known = std::min(system.landmarks->known.size(), std::size(kPlaces));
  WithLandmarks with{system, {}, known, BlockIn(*first, "position")};
  with.system.landmarks.reset();
  std::erase_if(with.system.sensors, sees);
  const std::vector<double> r = StartOf(system, with.camera, {0.0, 0.0, 0.0});
  const std::vector<double> q =
      StartOf(system, BlockIn(*first, "orientation"), {1.0, 0.0, 0.0, 0.0});
  const auto& prior = system.landmarks->prior;
  constexpr double kFarthest_m = 1000.0;  // a prior at infinity would tell nothing of scale
  const double distance_m = prior ? std::min(1.0 / prior->inverse_distance, kFarthest_m) : 2.0;
  const Space xyz{"landmark", "m", "", {"x", "y", "z"}, Geometry::Vector(3)};
  for (const auto& place : kPlaces) {
    const double h[3] = {distance_m * place[0], distance_m * place[1], distance_m * place[2]};
    double p[3];
    UnitQuaternion::Rotate(q.data(), h, p);
    Vec<3>::Plus(r.data(), p, p);
    const std::string name = std::string(kLandmarks) + '.' + std::to_string(with.landmarks.size());
    const BlockId block = with.system.layout.Declare(name, kLandmarks, xyz);
    with.landmarks.push_back(block);
    with.system.priors.push_back({block, {p, p + 3}, Eigen::Matrix3d::Identity(), {}});
    for (const SensorBinding& sensor : system.sensors) {
      if (sees(sensor)) with.system.sensors.push_back(SeenAs(sensor, block));
    }
  }
  return with;
}

}  // namespace alidade
