// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "alidade/filter/ekf.h"
#include "alidade/host/in_process.h"
#include "motion_models/constant.h"
#include "motion_models/constant_velocity.h"
#include "sensors/scale_2d.h"
#include "sensors/stereo_disparity.h"
#include "support/manifold_models.h"

/// Small systems composed in C++, for tests.
namespace alidade::testing {

/// z = gain x + n, linear: the Kalman filter is exact.
struct Linear : Sensor<Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"x", "m"}};
  static constexpr Quantity kMeasurement{"z", "m"};
  static constexpr int kInitialises = 0;
  double gain = 1.0, sigma = 1.0;
  Linear(double g, double s) : gain(g), sigma(s) {}
  template <class T>
  bool Predict(const T* x, T* z) const {
    z[0] = gain * x[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(sigma);
  }
  template <class T>
  bool Initialise(const T* z, T* x) const {
    x[0] = z[0] / gain;
    return true;
  }
};

struct GivenPrior {
  std::string block;
  double mean, sigma;
};

/// Adds a state entry whose scalar blocks start at the given priors.
inline void AddMotion(System& system, const std::string& name, const MotionModel& model,
                      const std::vector<GivenPrior>& priors) {
  MotionBinding binding{name, model, {}};
  for (std::size_t i = 0; i < priors.size(); ++i) {
    const BlockId id = system.layout.Declare(name + "." + priors[i].block, name, model.blocks()[i]);
    binding.blocks.push_back(id);
    Prior prior;
    prior.block = id;
    prior.mean = {priors[i].mean};
    prior.covariance = Eigen::MatrixXd::Constant(1, 1, priors[i].sigma * priors[i].sigma);
    system.priors.push_back(prior);
  }
  system.motions.push_back(binding);
}

inline void AddSensor(System& system, const std::string& name, const SensorModel& model,
                      const std::vector<std::string>& blocks) {
  SensorBinding binding{name, name, model, {}};
  for (const std::string& block : blocks) {
    RoleBinding role;
    role.block = system.layout.Find(block);
    binding.roles.push_back(role);
  }
  system.sensors.push_back(binding);
}

/// Constant velocity but for an acceleration that each step has by itself, constant during it.
struct Jolted : ConstantVelocity<1, false> {
  using ConstantVelocity<1, false>::ConstantVelocity;
  NoiseKind noise_kind() const { return NoiseKind::kContinuous; }
};

inline System PointOf(const MotionModel& model) {
  System system;
  AddMotion(system, "p", model, {{"x", 1.0, 2.0}, {"v", -0.5, 3.0}});
  return system;
}
/// A point that moves with constant velocity, jolted at each step: blocks `p.x`, `p.v`.
inline System MovingPoint(double acceleration = 1.0) {
  return PointOf(InProcessMotion(Jolted(acceleration), "jolted"));
}
/// The same, with an acceleration that is held from one update to the next.
inline System HeldPoint(double acceleration = 1.0) {
  return PointOf(InProcessMotion(ConstantVelocity<1, false>(acceleration), "constant_velocity"));
}

/// The depth filter: blocks `target.depth`, `target.depth_rate`, `template.inverse_distance`;
/// sensors `disparity` (BF = 26 px m, 1 px) and `inverse_scale` (300 px, 1 px).
inline System DepthFilter() {
  System system;
  AddMotion(system, "target", InProcessMotion(ConstantVelocity<1, false>(1.0), "constant_velocity"),
            {{"depth", 0.35, 0.1}, {"depth_rate", 0.0, 0.5}});
  AddMotion(system, "template", InProcessMotion(Constant<>(1), "constant"),
            {{"inverse_distance", 3.3, 0.5}});
  AddSensor(system, "disparity",
            InProcessSensor(StereoDisparity(400.0, 0.065, 1.0), "stereo_disparity"),
            {"target.depth"});
  AddSensor(system, "inverse_scale", InProcessSensor(Scale2d::FromPixels(300.0, 1.0), "scale_2d"),
            {"target.depth", "template.inverse_distance"});
  return system;
}

/// The same system, the block `name` (empty: every block) estimated, consider or constant.
inline System WithStatus(System system, const std::string& name, BlockStatus status) {
  StateLayout layout;
  for (const Block& block : system.layout.blocks()) {
    const bool meant = name.empty() || block.name == name;
    layout.Declare(block.name, block.owner, block.space, meant ? status : block.status);
  }
  system.layout = layout;
  return system;
}

/// z = sqrt(5 - x), not a number once x passes 5, and no more its Jacobian.
struct Broken : Sensor<Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"x"}};
  static constexpr Quantity kMeasurement{"z"};
  template <class T>
  bool Predict(const T* x, T* z) const {
    using std::sqrt;
    z[0] = sqrt(T(5.0) - x[0]);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(1.0);
  }
};

/// An orientation that walks at random, known to 0.1 rad at first and measured to 0.05 rad.
inline System WalkingOrientation() {
  System system;
  AddMotion(system, "q", InProcessMotion(ManifoldWalk<UnitQuaternion, 0.01>(), "walk"),
            {{"x", 0.0, 0.1}});
  system.priors[0].mean = {1.0, 0.0, 0.0, 0.0};
  system.priors[0].covariance = 0.01 * Eigen::Matrix3d::Identity();
  AddSensor(system, "z", InProcessSensor(ManifoldSensor<UnitQuaternion, 0.05>(), "seen"), {"q.x"});
  return system;
}

inline std::vector<StreamInfo> StreamsOf(const System& system) {
  std::vector<StreamInfo> streams;
  for (const SensorBinding& sensor : system.sensors) {
    streams.push_back({sensor.stream, sensor.model.measurement().geometry.ambient, 0.0,
                       sensor.model.known_size()});
  }
  return streams;
}

/// A frame with one scalar for each (stream, value).
inline Frame FrameAt(double t_s, const std::vector<std::pair<int, double>>& values) {
  Frame frame;
  frame.timestamp = TimestampFromSeconds(t_s);
  for (const auto& [stream, value] : values) {
    frame.measurements.push_back({frame.timestamp, stream, -1, {value}, {}});
  }
  return frame;
}

inline bool HasEvent(const UpdateReport& report, const std::string& kind) {
  return std::ranges::count(report.events, kind, &Event::kind) > 0;
}

inline double ValueOf(const State& state, const std::string& block) {
  return *state.value(state.layout().Find(block));
}
inline double CovarianceOf(const State& state, const std::string& a, const std::string& b) {
  const StateLayout& layout = state.layout();
  return state.covariance().Block(layout[layout.Find(a)].tangent_offset, 1,
                                  layout[layout.Find(b)].tangent_offset, 1)(0);
}

}  // namespace alidade::testing
