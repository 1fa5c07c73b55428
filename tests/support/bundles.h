// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "alidade/bundle/bundle_file.h"
#include "alidade/estimation/direct_models.h"
#include "alidade/model/geometry.h"
#include "sensors/self_calibrating_feature.h"

/// Generated bundles, for tests.
namespace alidade::testing {

/// Returns sample `i` of deterministic noise, a product of a sine and a cosine.
inline double Wave(int i) { return std::sin(1.7 * i + 0.3) * std::cos(0.9 * i); }

/// Returns a problem at its true values, with observations without noise. The `cameras` are on an
/// arc around the `points`, which are in a box 6 m ahead.
inline BundleFile TrueBundle(int cameras = 6, int points = 40) {
  BundleFile file;
  BundleProblem& problem = file.problem;
  problem.sensor = "{model: self_calibrating_feature, lens: radial, sigma_px: 1}";
  for (int i = 0; i < points; ++i)
    problem.points.push_back({2.0 * Wave(3 * i), 2.0 * Wave(3 * i + 1), 6.0 + Wave(3 * i + 2)});
  const SelfCalibratingFeature<RadialLens> sensor(1.0);
  for (int i = 0; i < cameras; ++i) {
    BundleCamera camera;
    const int of_six = i % 6;
    const double angle = 0.25 * (i - 0.5 * cameras);
    const double d[3] = {0.02 * of_six, -angle, 0.01 * of_six * of_six};
    camera.position = {6.0 * std::sin(angle), 0.1 * of_six, 6.0 - 6.0 * std::cos(angle)};
    UnitQuaternion::Exp(d, camera.orientation.data());
    camera.intrinsics = i;
    problem.cameras.push_back(camera);
    problem.intrinsics.push_back({500.0 + 10.0 * of_six, -0.1 + 0.01 * of_six, 0.02});
    for (int k = 0; k < points; ++k) {
      if ((i + k) % 5 == 0) continue;
      BundleObservation seen{i, k, {}, true};
      if (sensor.Predict(camera.position.data(), camera.orientation.data(),
                         problem.intrinsics.back().data(),
                         problem.points[static_cast<std::size_t>(k)].data(), seen.z.data()))
        problem.observations.push_back(seen);
    }
  }
  return file;
}

/// Returns a problem of cameras side by side. One point in four is behind the cameras; the other
/// points are in front. The noise is about half a pixel, and is the same in every run. The sensor
/// is the projective camera of BAL.
inline BundleFile BundleOnBothSides(int cameras = 8, int points = 60) {
  BundleFile file;
  BundleProblem& problem = file.problem;
  problem.sensor =
      "{model: self_calibrating_feature, lens: radial, domain: projective, sigma_px: 1}";
  for (int i = 0; i < points; ++i) {
    const double side = i % 4 == 0 ? -1.0 : 1.0;
    problem.points.push_back(
        {3.0 * Wave(3 * i), 3.0 * Wave(3 * i + 1), side * (8.0 + Wave(3 * i + 2))});
  }
  const SelfCalibratingFeature<RadialLens> sensor(1.0, true);
  int noise = 1000;
  for (int i = 0; i < cameras; ++i) {
    BundleCamera camera;
    const double d[3] = {0.1 * Wave(7 * i), 0.1 * Wave(7 * i + 1), 0.1 * Wave(7 * i + 2)};
    for (int k = 0; k < 3; ++k)
      camera.position[static_cast<std::size_t>(k)] = 1.5 * Wave(7 * i + 3 + k);
    UnitQuaternion::Exp(d, camera.orientation.data());
    camera.intrinsics = i;
    problem.cameras.push_back(camera);
    problem.intrinsics.push_back({500.0 + i, -0.05, 0.01});
    for (int k = 0; k < points; ++k) {
      if ((i + k) % 5 == 0) continue;
      BundleObservation seen{i, k, {}, true};
      if (!sensor.Predict(camera.position.data(), camera.orientation.data(),
                          problem.intrinsics.back().data(),
                          problem.points[static_cast<std::size_t>(k)].data(), seen.z.data()))
        continue;
      for (std::size_t c = 0; c < 2; ++c) seen.z[c] += Wave(++noise);
      problem.observations.push_back(seen);
    }
  }
  return file;
}

/// Shifts every 17th observation by 80 px.
inline void AddOutliers(BundleProblem& problem) {
  for (std::size_t i = 0; i < problem.observations.size(); i += 17)
    problem.observations[i].z[0] += 80.0;
}

/// Returns the median distance of the other cameras from the first camera.
inline double MedianDistance(const std::vector<std::array<double, 3>>& positions) {
  std::vector<double> distances;
  for (std::size_t i = 1; i < positions.size(); ++i) {
    distances.push_back(std::hypot(positions[i][0] - positions[0][0],
                                   positions[i][1] - positions[0][1],
                                   positions[i][2] - positions[0][2]));
  }
  std::ranges::sort(distances);
  return distances[distances.size() / 2];
}

/// Moves all points, and all cameras except the first, by up to 5 cm. Turns these cameras by up to
/// 0.01 rad. Changes the focal lengths by up to 1 %.
inline void Disturb(BundleProblem& problem) {
  int i = 0;
  for (auto& camera : problem.cameras) {
    auto& lens = problem.intrinsics[static_cast<std::size_t>(camera.intrinsics)];
    lens[0] *= 1.0 + 0.01 * Wave(++i);
    if (&camera == problem.cameras.data()) continue;
    for (double& x : camera.position) x += 0.05 * Wave(++i);
    double d[3], before[4];
    for (double& x : d) x = 0.01 * Wave(++i);
    std::copy_n(camera.orientation.data(), 4, before);
    UnitQuaternion::Plus(before, d, camera.orientation.data());
  }
  for (auto& point : problem.points) {
    for (double& x : point) x += 0.05 * Wave(++i);
  }
}

}  // namespace alidade::testing
