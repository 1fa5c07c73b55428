// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "alidade/base/error.h"
#include "alidade/estimation/direct_models.h"
#include "alidade/estimation/ekf.h"
#include "alidade/testing/frames.h"
#include "motion_models/constant_velocity.h"

/// Small problems, composed in C++. For tests.
namespace alidade::testing {

/// Sensor z = gain x + n. It is linear, so the Kalman filter is exact.
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

/// Sensor z = a x + b y + n.
struct WeightedSum : Sensor<Vec<1>, Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"x"}, Quantity{"y"}};
  static constexpr Quantity kMeasurement{"z"};
  double a, b, sigma;
  WeightedSum(double first, double second, double s) : a(first), b(second), sigma(s) {}
  template <class T>
  bool Predict(const T* x, const T* y, T* z) const {
    z[0] = a * x[0] + b * y[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = T(sigma);
  }
};

// Models that most tests use, compiled only once in systems.cc.
SharedSensor LinearSensor(double gain, double sigma);
SharedSensor SumSensor(double a, double b, double sigma);
SharedMotion ConstantMotion(int size, double random_walk = 0.0);
/// Returns a constant-velocity model on one axis, with discrete noise.
SharedMotion ConstantVelocityMotion(double acceleration);

struct GivenPrior {
  std::string block;
  double mean, sigma;
};

/// Adds a state entry whose scalar blocks have the given priors.
void AddMotion(Problem& problem, const std::string& name, const SharedMotion& model,
               const std::vector<GivenPrior>& priors);
/// Adds a sensor that reads the stream of the same name.
void AddSensor(Problem& problem, const std::string& name, const SharedSensor& model,
               const std::vector<std::string>& blocks);

/// Constant-velocity model with a random acceleration. The acceleration is constant within a step
/// and independent between steps.
struct Jolted : ConstantVelocity<1, false> {
  using ConstantVelocity<1, false>::ConstantVelocity;
  NoiseKind noise_kind() const { return NoiseKind::kContinuous; }
};

/// Returns a problem of a point with the motion model Jolted: blocks `p.x`, `p.v`.
Problem MovingPoint(double acceleration = 1.0);
/// Returns the problem of MovingPoint() with an acceleration that is constant between two updates.
Problem HeldPoint(double acceleration = 1.0);

/// Returns the problem of the depth filter. The blocks are `target.depth`, `target.depth_rate` and
/// `template.inverse_distance`. The sensors are `disparity` (BF = 26 px m, sigma 1 px) and
/// `inverse_scale` (template 300 px, sigma 1 px).
Problem DepthFilter();

/// Returns the problem with a new status of block `name`. If `name` is empty, every block receives
/// this status.
Problem WithStatus(Problem problem, const std::string& name, BlockStatus status);

/// Sensor z = sqrt(5 - x). z and its Jacobian are NaN for x > 5.
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

/// Returns a problem of an orientation that performs a random walk. The sigmas are 0.1 rad for the
/// prior and 0.05 rad for the sensor.
Problem WalkingOrientation();

}  // namespace alidade::testing
