// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "alidade/model/plugin.h"

namespace {

using alidade::Angle;
using alidade::Quantity;
using alidade::Vec;

/// Robot in the plane. Its speed and its turn rate are the control input.
///
///   model      x' = x + [cos h, sin h] (v + w0) dt,   h' = h + (o + w1) dt
///   noise      w ~ N(0, diag(sigma_v^2, sigma_o^2) / dt)
///
///   symbol     shape  unit       frame  meaning
///   x          2      m          world  position
///   h          1      rad        world  heading
///   v, o       1      m/s, rad/s body   speed, turn rate: the control input
struct Planar : alidade::Motion<2, Vec<2>, Angle> {
  static constexpr std::array kBlocks{Quantity{"position", "m"}, Quantity{"heading", "rad"}};
  using Input = Vec<2>;
  static constexpr Quantity kInput{"speed_and_turn_rate", ""};
  double speed, turn_rate;
  explicit Planar(alidade::Params& p)
      : speed(p.Positive("noise.speed", "m/s^0.5", "noise of the speed")),
        turn_rate(p.Positive("noise.turn_rate", "rad/s^0.5", "noise of the turn rate")) {}
  template <class T>
  void Step(const T* x, const T* heading, const T* u, const T* w, double dt_s, T* next,
            T* next_heading) const {
    using std::cos;
    using std::sin;
    const T distance = (u[0] + w[0]) * dt_s;
    next[0] = x[0] + cos(heading[0]) * distance;
    next[1] = x[1] + sin(heading[0]) * distance;
    next_heading[0] = heading[0] + (u[1] + w[1]) * dt_s;
  }
  void SqrtQ(double dt_s, alidade::MatrixRef l) const {
    const double rate = dt_s > 0.0 ? 1.0 / std::sqrt(dt_s) : 0.0;
    l(0, 0) = speed * rate;
    l(1, 1) = turn_rate * rate;
  }
};

/// Sensor z = x + n, n ~ N(0, sigma^2 I).
struct PlanarFix : alidade::Sensor<Vec<2>, Vec<2>> {
  static constexpr std::array kRoles{Quantity{"position", "m"}};
  static constexpr Quantity kMeasurement{"fix", "m"};
  double sigma_m;
  explicit PlanarFix(alidade::Params& p)
      : sigma_m(p.Positive("sigma_m", "m", "noise of a fix, 1 sigma")) {}
  template <class T>
  bool Predict(const T* position, T* fix) const {
    fix[0] = position[0];
    fix[1] = position[1];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = l[3] = T(sigma_m);
  }
};

}  // namespace

ALIDADE_PLUGIN(ALIDADE_MOTION(Planar, "planar", "a robot in the plane", ""),
               ALIDADE_SENSOR(PlanarFix, "planar_fix", "position fix of the robot", ""))
