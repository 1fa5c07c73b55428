// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

/// Work of all contenders: a step of the depth filter of [Ekf2017] with the state (Z, Zdot,
/// lambda). A step consists of a prediction and two measurements. The disparity is B F / Z with 1
/// px of noise. The inverse scale is lambda Z with noise propagated from 1 px on a template of 300
/// px. The initial estimate is Z = 0.35 +- 0.1 m, Zdot = 0 +- 0.5 m/s, lambda = 3.3 +- 0.5 1/m.
namespace alidade::bench {

inline constexpr double kDt = 0.033;            ///< time step, s
inline constexpr double kBf = 26.0;             ///< B F, px m
inline constexpr double kAcceleration = 1.0;    ///< sigma of the acceleration, m/s^2
inline constexpr double kRelative = 2.0 / 300;  ///< sigma of the inverse scale s, divided by s^3

/// Periodic measurements of a target that oscillates about a depth of 0.3 m.
struct TargetMeasurements {
  static constexpr int kPeriod = 1024;
  std::vector<double> disparity, inverse_scale;

  TargetMeasurements() {
    for (int i = 0; i < kPeriod; ++i) {
      const double depth = 0.3 + 0.1 * std::sin(2.0 * std::numbers::pi * 13.0 * i / kPeriod);
      disparity.push_back(kBf / depth + 0.7 * std::sin(1.7 * i));
      inverse_scale.push_back(depth / 0.3 + 0.005 * std::cos(2.3 * i));
    }
  }
};

/// Filter of another library, without a gate.
class Peer {
 public:
  virtual ~Peer() = default;
  virtual void Step(double disparity, double inverse_scale) = 0;
  virtual double depth() const = 0;
};

// Each function is defined in a separate source file, which is built if the library is installed.
std::unique_ptr<Peer> MakeOpenCv();
std::unique_ptr<Peer> MakeBfl();
std::unique_ptr<Peer> MakeMrpt();

}  // namespace alidade::bench
