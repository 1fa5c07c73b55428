// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdio>

#include "alidade/estimation/direct_models.h"
#include "alidade/estimation/ekf.h"
#include "alidade/evaluate/trajectory.h"

namespace {

/// A random walk in three dimensions: x' = x + w, w ~ N(0, dt).
struct Walk : alidade::Motion<3, alidade::Vec<3>> {
  static constexpr std::array kBlocks{alidade::Quantity{"position", "m", "", "x,y,z"}};
  template <class T>
  void Step(const T* x, const T* w, double, T* next) const {
    for (int i = 0; i < 3; ++i) next[i] = x[i] + w[i];
  }
  void SqrtQ(double dt_s, alidade::MatrixRef l) const {
    for (int i = 0; i < 3; ++i) l(i, i) = std::sqrt(dt_s);
  }
};

/// Measures the position in three dimensions: z = x + n, n ~ N(0, 1).
struct Seen : alidade::Sensor<alidade::Vec<3>, alidade::Vec<3>> {
  static constexpr std::array kRoles{alidade::Quantity{"position", "m", "", "x,y,z"}};
  static constexpr alidade::Quantity kMeasurement{"z", "m", "", "x,y,z"};
  template <class T>
  bool Predict(const T* x, T* z) const {
    for (int i = 0; i < 3; ++i) z[i] = x[i];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    for (int i = 0; i < 3; ++i) l[4 * i] = T(1.0);
  }
};

alidade::Problem WalkSystem() {
  alidade::Problem problem;
  alidade::MotionBinding motion{"p", alidade::MakeMotion(Walk(), "walk"), {}};
  alidade::Prior prior;
  prior.block = problem.layout.Declare("p.position", "p", motion.model->blocks()[0]);
  prior.mean = {0.0, 0.0, 0.0};
  prior.covariance = Eigen::MatrixXd::Identity(3, 3);
  motion.blocks.push_back(prior.block);
  problem.priors.push_back(prior);
  problem.motions.push_back(motion);
  alidade::SensorBinding sensor{"seen", "seen", alidade::MakeSensor(Seen(), "seen"), {}};
  alidade::RoleBinding role;
  role.block = prior.block;
  sensor.roles.push_back(role);
  problem.sensors.push_back(sensor);
  return problem;
}

/// Returns true if the program and the library share their heap: each can resize and free memory
/// that the other has allocated.
bool SharesTheHeap(const alidade::Ekf& ekf) {
  for (int rows = 1; rows <= 3; ++rows) {
    Eigen::MatrixXd block = ekf.state().covariance().Block(0, rows, 0, 3);
    block.conservativeResize(4 * rows, 7);
    if (block.rows() != 4 * rows) return false;
  }
  alidade::Trajectory trajectory;
  for (int i = 0; i < 5; ++i) {
    trajectory.timestamps.push_back(i);
    trajectory.orientations.emplace_back(1.0, 0.0, 0.0, 0.0);
  }
  trajectory.positions = Eigen::Matrix3Xd::Identity(3, 5);
  const alidade::Trajectory selected = trajectory.Select({0, 2, 4});
  return selected.orientations.back().w() == 1.0 && selected.positions.sum() == 2.0;
}

}  // namespace

// Returns 0 if a filter of the library, compiled with the flags of this program, equals the scalar
// Kalman filter: P' = P + 1, K = P' / (P' + 1), x' = x + K (z - x), P = P' - K P'.
int main() {
  alidade::Ekf ekf(WalkSystem(), {}, {{"seen", 3}});
  double x = 0.0, p = 1.0;
  for (int k = 0; k < 50; ++k) {
    const double z = std::sin(0.3 * k);
    alidade::Frame frame;
    frame.timestamp = alidade::TimestampFromSeconds(k);
    frame.measurements.push_back({frame.timestamp, 0, -1, {z, z, z}, {}});
    ekf.Process(frame);
    p += k > 0 ? 1.0 : 0.0;
    const double gain = p / (p + 1.0);
    x += gain * (z - x);
    p -= gain * p;
    const Eigen::MatrixXd covariance = ekf.state().covariance().Dense();
    for (int i = 0; i < 3; ++i) {
      const double error = std::abs(ekf.state().value(0)[i] - x) + std::abs(covariance(i, i) - p);
      if (error <= 1e-12) continue;
      std::printf("step %d, element %d: off by %g\n", k, i, error);
      return 1;
    }
  }
  return SharesTheHeap(ekf) ? 0 : 1;
}
