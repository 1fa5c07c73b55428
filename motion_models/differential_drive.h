// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/arc.h"
#include "alidade/model/process_noise.h"

namespace alidade {

/// Robot in the plane with two driven wheels on one axis, whose angular speeds are measured.
///
///   model      v_i = R (1 + e_i) (u_i + w_i) for the left and the right wheel
///              s = (v_l + v_r) dt / 2,   phi = (v_r - v_l) dt / (B (1 + e_B))
///              r' = r + s sin(phi/2)/(phi/2) [cos(h + phi/2); sin(h + phi/2)],   h' = h + phi
///              e_l, e_r and e_B are model parameter states, known to be 0 unless the config
///              defines initial values
///   noise      continuous: w ~ N(0, diag(sigma^2) / dt), white angular speeds
///              discrete: w ~ N(0, diag(sigma^2)), constant between two updates
///   Jacobian   automatic differentiation               6 x 6; exact at phi = 0
///
///   symbol         shape  unit       frame  meaning
///   r              2      m          world  position of the point midway between the wheels
///   h              1      rad        world  heading, from x to y
///   u_l, u_r       1      rad/s      -      control input: measured angular speeds of the left and
///                                           the right wheel, constant over dt; > 0: forward
///   R, B           1      m          -      radius of the wheels, distance between them; > 0
///   e_l, e_r, e_B  1      -          -      relative errors: true value / given value - 1
///   sigma          2      rad/s^0.5  -      noise of u_l and u_r; >= 0. Continuous: root of the
///                                           spectral density; discrete: standard deviation, rad/s
///
/// Defined for  e_B > -1; else out_of_domain, outputs untouched. Steps without noise are exact.
/// Source       [Siegwart2011] sec. 3.2; errors of the odometry [Borenstein1996].
struct DifferentialDrive : Motion<2, Vec<2>, Angle, Vec<1>, Vec<1>, Vec<1>> {
  static constexpr std::array kBlocks{
      Quantity{"position", "m", "position in the world", "x,y"},
      Quantity{"heading", "rad", "heading, from x to y"},
      Quantity{"left_radius_scale_error", "", "true radius of the left wheel / given radius - 1",
               "", ALIDADE_ROLE_OWNED},
      Quantity{"right_radius_scale_error", "", "true radius of the right wheel / given radius - 1",
               "", ALIDADE_ROLE_OWNED},
      Quantity{"track_width_scale_error", "", "true track width / given track width - 1", "",
               ALIDADE_ROLE_OWNED}};
  using Input = Vec<2>;
  static constexpr Quantity kInput{"wheel_speeds", "rad/s",
                                   "angular speeds of the left and the right wheel", "left,right"};

  InputNoise<2> noise;
  double radius_m, track_m;

  DifferentialDrive(NoiseKind kind, const std::array<double, 2>& sigma, double wheel_radius_m,
                    double track_width_m)
      : noise{kind, sigma}, radius_m(wheel_radius_m), track_m(track_width_m) {}
  explicit DifferentialDrive(Params& p) : DifferentialDrive(p, InputNoise<2>::ReadKind(p)) {}
  DifferentialDrive(Params& p, NoiseKind kind)
      : DifferentialDrive{
            kind,
            p.PerAxis<2>("noise.wheel_speed", kind == NoiseKind::kDiscrete ? "rad/s" : "rad/s^0.5",
                         "noise of the angular speed of a wheel; a list: left, right",
                         kNonNegative),
            p.Positive("wheel_radius_m", "m", "radius of the wheels"),
            p.Positive("track_width_m", "m", "distance between the wheels")} {}

  NoiseKind noise_kind() const { return noise.kind; }
  template <class T>
  bool Step(const T* r, const T* h, const T* e_left, const T* e_right, const T* e_track, const T* u,
            const T* w, double dt_s, T* r1, T* h1, T* e_left1, T* e_right1, T* e_track1) const {
    const T track = track_m * (1.0 + e_track[0]);
    if (!(track > T(0.0))) return false;
    const T left = dt_s * radius_m * (1.0 + e_left[0]) * (u[0] + w[0]),
            right = dt_s * radius_m * (1.0 + e_right[0]) * (u[1] + w[1]);
    const T displacement[2] = {0.5 * (left + right), T(0.0)};
    MoveAlongArc(r, h, displacement, T((right - left) / track), r1, h1);
    e_left1[0] = e_left[0];
    e_right1[0] = e_right[0];
    e_track1[0] = e_track[0];
    return true;
  }
  void SqrtQ(double dt_s, MatrixRef l) const { noise.SqrtQ(dt_s, l); }
};

}  // namespace alidade
