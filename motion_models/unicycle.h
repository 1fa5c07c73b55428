// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/arc.h"
#include "alidade/model/process_noise.h"

namespace alidade {

/// Vehicle in the plane with measured speed and turn rate, which cannot move sideways.
///
///   model      s = (v + w_v) dt,   phi = (omega + w_omega) dt
///              r' = r + s sin(phi/2)/(phi/2) [cos(h + phi/2); sin(h + phi/2)],   h' = h + phi
///   noise      continuous: w ~ N(0, diag(sigma_v^2, sigma_omega^2) / dt), white velocities
///              discrete: w ~ N(0, diag(sigma_v^2, sigma_omega^2)), constant between two updates
///   Jacobian   automatic differentiation               3 x 3; exact at phi = 0
///
///   symbol       shape  unit       frame  meaning
///   r            2      m          world  position of the point midway between the wheels
///   h            1      rad        world  heading, from x to y
///   v, omega     1      m/s        body   control input: measured speed and turn rate, constant
///                       rad/s             over dt
///   sigma_v      1      m/s^0.5    body   noise of v; >= 0. Continuous: root of the spectral
///                                         density; discrete: standard deviation, m/s
///   sigma_omega  1      rad/s^0.5  body   noise of omega, defined like sigma_v; discrete: rad/s
///
/// Defined everywhere. Steps without noise are exact: an arc of a circle. Continuous noise is
/// additive up to an error of order dt^3 in the lateral displacement.
/// Source       [Thrun2005] sec. 5.3.
struct Unicycle : Motion<2, Vec<2>, Angle> {
  static constexpr std::array kBlocks{Quantity{"position", "m", "position in the world", "x,y"},
                                      Quantity{"heading", "rad", "heading, from x to y"}};
  using Input = Vec<2>;
  static constexpr Quantity kInput{"velocities", "", "speed, m/s, and turn rate, rad/s", "v,omega"};

  InputNoise<2> noise;

  Unicycle(NoiseKind kind, double sigma_speed, double sigma_turn_rate)
      : noise{kind, {sigma_speed, sigma_turn_rate}} {}
  explicit Unicycle(Params& p) : Unicycle(p, InputNoise<2>::ReadKind(p)) {}
  Unicycle(Params& p, NoiseKind kind)
      : Unicycle{
            kind,
            p.NonNegative("noise.speed", kind == NoiseKind::kDiscrete ? "m/s" : "m/s^0.5",
                          "noise of the speed"),
            p.NonNegative("noise.turn_rate", kind == NoiseKind::kDiscrete ? "rad/s" : "rad/s^0.5",
                          "noise of the turn rate")} {}

  NoiseKind noise_kind() const { return noise.kind; }
  template <class T>
  void Step(const T* r, const T* h, const T* u, const T* w, double dt_s, T* r1, T* h1) const {
    const T displacement[2] = {dt_s * (u[0] + w[0]), T(0.0)};
    MoveAlongArc(r, h, displacement, T(dt_s * (u[1] + w[1])), r1, h1);
  }
  void SqrtQ(double dt_s, MatrixRef l) const { noise.SqrtQ(dt_s, l); }
};

}  // namespace alidade
