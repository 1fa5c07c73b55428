// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/arc.h"
#include "alidade/model/process_noise.h"

namespace alidade {

/// Car or bicycle in the plane with measured speed and steering angle, without slip.
///
///   model      s = (v + w_v) dt,   phi = (s tan delta + v dt w_delta / cos^2 delta) / L
///              r' = r + s sin(phi/2)/(phi/2) [cos(h + phi/2); sin(h + phi/2)],   h' = h + phi
///   noise      of first order in w, so that it may be white
///              continuous: w ~ N(0, diag(sigma_v^2, sigma_delta^2) / dt), white
///              discrete: w ~ N(0, diag(sigma_v^2, sigma_delta^2)), constant between two updates
///   Jacobian   automatic differentiation               3 x 3; exact at phi = 0
///
///   symbol       shape  unit       frame  meaning
///   r            2      m          world  position of the middle of the rear axle
///   h            1      rad        world  heading, from x to y
///   v            1      m/s        body   control input: measured speed of the rear axle
///   delta        1      rad        body   control input: measured angle of the (middle) front
///                                         wheel; > 0: to the left. Both are constant over dt
///   L            1      m          body   wheelbase: distance between the axles; > 0
///   sigma_v      1      m/s^0.5    body   noise of v; >= 0. Continuous: root of the spectral
///                                         density; discrete: standard deviation, m/s
///   sigma_delta  1      rad s^0.5  body   noise of delta, defined like sigma_v; discrete: rad
///
/// Defined for  |delta| < pi/2; else out_of_domain, outputs untouched. Steps without noise are
/// exact.
/// Source       [Corke2017] sec. 4.1.1.
struct Bicycle : Motion<2, Vec<2>, Angle> {
  static constexpr std::array kBlocks{
      Quantity{"position", "m", "position of the rear axle in the world", "x,y"},
      Quantity{"heading", "rad", "heading, from x to y"}};
  using Input = Vec<2>;
  static constexpr Quantity kInput{"drive", "", "speed, m/s, and steering angle, rad", "v,delta"};

  InputNoise<2> noise;
  double wheelbase_m;

  Bicycle(NoiseKind kind, double sigma_speed, double sigma_steering_angle, double wheelbase)
      : noise{kind, {sigma_speed, sigma_steering_angle}}, wheelbase_m(wheelbase) {}
  explicit Bicycle(Params& p) : Bicycle(p, InputNoise<2>::ReadKind(p)) {}
  Bicycle(Params& p, NoiseKind kind)
      : Bicycle{kind,
                p.NonNegative("noise.speed", kind == NoiseKind::kDiscrete ? "m/s" : "m/s^0.5",
                              "noise of the speed"),
                p.NonNegative("noise.steering_angle",
                              kind == NoiseKind::kDiscrete ? "rad" : "rad s^0.5",
                              "noise of the steering angle"),
                p.Positive("wheelbase_m", "m", "distance between the axles")} {}

  NoiseKind noise_kind() const { return noise.kind; }
  template <class T>
  bool Step(const T* r, const T* h, const T* u, const T* w, double dt_s, T* r1, T* h1) const {
    using std::tan;
    constexpr double kRightAngle = 1.57079632679489661923;
    if (!(u[1] < T(kRightAngle) && u[1] > T(-kRightAngle))) return false;
    const T t = tan(u[1]);
    const T displacement[2] = {dt_s * (u[0] + w[0]), T(0.0)};
    // 1 / cos^2 = 1 + tan^2
    const T turn = (displacement[0] * t + dt_s * u[0] * (1.0 + t * t) * w[1]) / wheelbase_m;
    MoveAlongArc(r, h, displacement, turn, r1, h1);
    return true;
  }
  void SqrtQ(double dt_s, MatrixRef l) const { noise.SqrtQ(dt_s, l); }
};

}  // namespace alidade
