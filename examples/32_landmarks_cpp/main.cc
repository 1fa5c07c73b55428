// SPDX-License-Identifier: Apache-2.0
//
// A filter with landmarks and with models that this program defines. A robot drives with odometry,
// measures the points around it, and maps these points.
#include <alidade/estimation.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <random>

using alidade::Angle;
using alidade::Quantity;
using alidade::Vec;

/// Robot in the plane. Its input is the measured speed v and turn rate r. The input has noise w:
///
///   p' = p + (v + w_v) dt (cos a, sin a),   heading' = heading + (r + w_r) dt,
///   a = heading + (r + w_r) dt / 2
struct Robot : alidade::Motion<2, Vec<2>, Angle> {
  static constexpr std::array kBlocks{Quantity{"position", "m", "position in the world", "x,y"},
                                      Quantity{"heading", "rad", "angle from the x axis"}};
  using Input = Vec<2>;
  static constexpr Quantity kInput{"odometry", "", "speed in m/s and turn rate in rad/s", "v,r"};

  alidade::NoiseKind noise_kind() const { return alidade::NoiseKind::kDiscrete; }
  template <class T>
  void Step(const T* p, const T* heading, const T* u, const T* w, double dt_s, T* p1,
            T* heading1) const {
    using std::cos;
    using std::sin;
    const T turn_rad = dt_s * (u[1] + w[1]), distance_m = dt_s * (u[0] + w[0]);
    p1[0] = p[0] + distance_m * cos(heading[0] + 0.5 * turn_rad);
    p1[1] = p[1] + distance_m * sin(heading[0] + 0.5 * turn_rad);
    heading1[0] = heading[0] + turn_rad;
  }
  void SqrtQ(double, alidade::MatrixRef l) const {
    l(0, 0) = 0.1;   // m/s
    l(1, 1) = 0.05;  // rad/s
  }
};

/// Measures the position of a point in the frame of the robot: x ahead, y to the left, z up.
struct PointInRobot : alidade::Sensor<Vec<3>, Vec<2>, Angle, Vec<3>> {
  static constexpr std::array kRoles{
      Quantity{"position", "m", "position of the robot", "x,y"}, Quantity{"heading", "rad"},
      Quantity{"landmark", "m", "position in the world", "x,y,z", ALIDADE_ROLE_LANDMARK}};
  static constexpr Quantity kMeasurement{"point", "m", "position relative to the robot", "x,y,z"};
  static constexpr int kInitialises = 2;

  template <class T>
  bool Predict(const T* p, const T* heading, const T* landmark, T* z) const {
    using std::cos;
    using std::sin;
    const T c = cos(heading[0]), s = sin(heading[0]);
    const T dx = landmark[0] - p[0], dy = landmark[1] - p[1];
    z[0] = c * dx + s * dy;
    z[1] = c * dy - s * dx;
    z[2] = landmark[2];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, T* l) const {
    l[0] = l[4] = l[8] = T(0.1);  // m
  }
  template <class T>
  bool Initialise(const T* p, const T* heading, const T* z, T* landmark) const {
    using std::cos;
    using std::sin;
    const T c = cos(heading[0]), s = sin(heading[0]);
    landmark[0] = p[0] + c * z[0] - s * z[1];
    landmark[1] = p[1] + s * z[0] + c * z[1];
    landmark[2] = z[2];
    return true;
  }
};

int main() {
  alidade::Problem problem;
  const auto robot =
      problem.AddState("robot", Robot(), {{"position", {0.0, 0.0}, 0.0}, {"heading", 0.0, 0.0}});
  const auto points =
      problem.AddSensor("points", PointInRobot(), {robot["position"], robot["heading"]});
  alidade::Ekf filter(problem, {.gate = 0.999});

  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  std::vector<std::array<double, 3>> world;
  for (int i = 0; i < 12; ++i) world.push_back({8.0 * std::cos(i), 8.0 * std::sin(i), 0.1 * i});
  constexpr double kSpeed = 1.0, kTurn = 0.2, kStep = 0.1;
  double p[2] = {0.0, 0.0}, heading = 0.0;
  for (int k = 0; k <= 600; ++k) {
    std::vector<alidade::Reading> readings{
        {robot, {kSpeed + 0.1 * normal(random), kTurn + 0.05 * normal(random)}}};
    for (std::size_t i = 0; i < world.size(); ++i) {
      const double* const roles[] = {p, &heading, world[i].data()};
      double z[3];
      PointInRobot().Predict(roles[0], roles[1], roles[2], z);
      if (std::hypot(z[0], z[1]) > 6.0) continue;
      for (double& element : z) element += 0.1 * normal(random);
      readings.push_back({points, {z[0], z[1], z[2]}, static_cast<std::int64_t>(i)});
    }
    filter.Push(alidade::TimestampFromSeconds(kStep * k), readings);
    p[0] += kSpeed * kStep * std::cos(heading + 0.5 * kTurn * kStep);
    p[1] += kSpeed * kStep * std::sin(heading + 0.5 * kTurn * kStep);
    heading += kTurn * kStep;
  }

  const auto [position, sigma] =
      filter.At(filter.timestamp() + 100'000'000).Estimate(robot["position"]);
  std::printf("robot at (%.2f, %.2f) m, +- (%.2f, %.2f), truth (%.2f, %.2f)\n", position[0],
              position[1], sigma[0], sigma[1], p[0], p[1]);
  for (const alidade::LandmarkEstimate& landmark : filter.landmarks()) {
    const auto& truth = world[static_cast<std::size_t>(landmark.id)];
    std::printf("landmark %2d at (%5.2f, %5.2f, %5.2f) m, +- %.2f, truth (%5.2f, %5.2f, %5.2f)\n",
                static_cast<int>(landmark.id), landmark.position[0], landmark.position[1],
                landmark.position[2], std::sqrt(landmark.covariance(0, 0)), truth[0], truth[1],
                truth[2]);
  }
}
