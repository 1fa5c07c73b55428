// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "alidade/model/arc.h"
#include "alidade/model/process_noise.h"

namespace alidade {

/// Pose of a camera on a vehicle with measured linear and angular velocity.
///
///   model      world_from_vehicle' = world_from_vehicle exp((v, omega) dt)
///              with world_from_vehicle = world_from_cam cam_from_vehicle. For the camera:
///              q' = q Exp(R_CV phi),  r' = r + R_WC R_CV (V(phi) nu dt + Exp(phi) t - t)
///              nu = (1 + e) v + w_v,  phi = (omega + w_omega) dt
///              V(phi) = I + (1 - cos)/|phi|^2 [phi]x + (|phi| - sin)/|phi|^3 [phi]x^2
///              t = t_0 + dt_m,  R_VC = R_m R_0;  dt_m, R_m and e are model parameter states,
///              known to be 0, I and 0 unless the config defines initial values
///   noise      continuous: w = (w_v, w_omega) ~ N(0, diag(sigma_v^2, sigma_omega^2) / dt), white
///              velocities; position and orientation are random walks
///              discrete: w ~ N(0, diag(sigma_v^2, sigma_omega^2)), constant between two updates,
///              so the random walk depends on the rate of the measurements
///   Jacobian   automatic differentiation               13 x 13; exact at omega = 0
///
///   symbol       shape  unit      frame    meaning
///   r, q         3, 4   m, -      world    position and orientation (world_from_cam) of the camera
///   v, omega     3      m/s       vehicle  control input: measured velocities, constant over dt.
///                       rad/s              v is the velocity of the vehicle's origin
///   sigma_v      3      m/s^0.5   vehicle  noise of v, for each axis; >= 0. Continuous: root of
///                                          the spectral density; discrete: standard deviation, m/s
///   sigma_omega  3      rad/s^0.5 vehicle  noise of omega, defined like sigma_v; discrete: rad/s
///   t_0, R_0     3, -   m, -      vehicle  vehicle_from_cam: position and orientation of the
///                                          camera
///   dt_m, R_m    3, 4   m, -      vehicle  extrinsics, relative to t_0 and R_0
///   e            1      -         -        relative error of v: true speed / measured - 1
///
/// Defined everywhere. Steps without noise are additive in dt. Continuous noise is additive up to
/// an error of order dt^3 in the lateral displacement of a turn. docs/noise_models.md compares both
/// kinds of noise and converts sigma.
/// Source       [Sola2017] sec. 4.6 (integration). V is the matrix V of exp on SE(3).
struct OdometryPose : Motion<6, Vec<3>, UnitQuaternion, Vec<3>, UnitQuaternion, Vec<1>> {
  static constexpr std::array kBlocks{
      Quantity{"position", "m", "position of the camera in the world", "x,y,z"},
      Quantity{"orientation", "", "orientation of the camera, world_from_cam", "w,x,y,z"},
      Quantity{"extrinsics_position", "m", "offset that is added to vehicle_from_cam.position",
               "x,y,z", ALIDADE_ROLE_OWNED},
      Quantity{"extrinsics_orientation", "",
               "rotation that multiplies vehicle_from_cam.orientation", "w,x,y,z",
               ALIDADE_ROLE_OWNED},
      Quantity{"speed_scale_error", "",
               "relative error of the measured speed: true speed / measured speed - 1", "",
               ALIDADE_ROLE_OWNED}};
  using Input = Vec<6>;
  static constexpr Quantity kInput{
      "velocities", "",
      "linear velocity, m/s, and angular velocity, rad/s, in the frame of the vehicle",
      "vx,vy,vz,wx,wy,wz"};

  InputNoise<6> noise;
  std::array<double, 3> mount;             ///< t_0
  std::array<double, 4> vehicle_from_cam;  ///< R_0

  OdometryPose(NoiseKind kind, const std::array<double, 3>& linear,
               const std::array<double, 3>& angular, const std::array<double, 3>& position = {},
               const std::array<double, 4>& orientation = {1.0, 0.0, 0.0, 0.0})
      : noise{kind, {linear[0], linear[1], linear[2], angular[0], angular[1], angular[2]}},
        mount(position),
        vehicle_from_cam(orientation) {
    UnitQuaternion::Normalise(vehicle_from_cam.data());
  }
  explicit OdometryPose(Params& p)
      : OdometryPose(p, InputNoise<6>::ReadKind(p) == NoiseKind::kDiscrete) {}
  OdometryPose(Params& p, bool is_discrete)
      : OdometryPose{
            is_discrete ? NoiseKind::kDiscrete : NoiseKind::kContinuous,
            p.PerAxis<3>("noise.linear_velocity", is_discrete ? "m/s" : "m/s^0.5",
                         is_discrete
                             ? "standard deviation of the linear velocity"
                             : "root of the spectral density of the linear velocity's noise",
                         kNonNegative),
            p.PerAxis<3>("noise.angular_velocity", is_discrete ? "rad/s" : "rad/s^0.5",
                         is_discrete
                             ? "standard deviation of the angular velocity"
                             : "root of the spectral density of the angular velocity's noise",
                         kNonNegative),
            p.Vector<3>("vehicle_from_cam.position", "m", "position of the camera on the vehicle",
                        {}, std::array<double, 3>{}),
            ReadVehicleFromCam(p)} {}

  NoiseKind noise_kind() const { return noise.kind; }
  template <class T>
  void Step(const T* r, const T* q, const T* shift, const T* tilt, const T* speed_scale_error,
            const T* u, const T* w, double dt_s, T* r1, T* q1, T* shift1, T* tilt1,
            T* speed_scale_error1) const {
    T phi[3], way[3], t[3], rotated_t[3], displacement[3], turn[3], step[3];
    for (int i = 0; i < 3; ++i) phi[i] = dt_s * (u[3 + i] + w[3 + i]);
    for (int i = 0; i < 3; ++i) way[i] = dt_s * ((1.0 + speed_scale_error[0]) * u[i] + w[i]);
    for (std::size_t i = 0; i < 3; ++i) t[i] = mount[i] + shift[i];
    T rotation[4], mounted[4];
    UnitQuaternion::Multiply(tilt, vehicle_from_cam.data(), mounted);
    UnitQuaternion::Exp(phi, rotation);
    UnitQuaternion::Rotate(rotation, t, rotated_t);
    IntegrateTurn<1>(phi, way, displacement);
    for (int i = 0; i < 3; ++i) displacement[i] += rotated_t[i] - t[i];
    UnitQuaternion::RotateBack(mounted, displacement, step);
    UnitQuaternion::RotateBack(mounted, phi, turn);
    UnitQuaternion::Rotate(q, step, displacement);
    for (int i = 0; i < 3; ++i) r1[i] = r[i] + displacement[i];
    UnitQuaternion::Plus(q, turn, q1);
    std::copy(shift, shift + 3, shift1);
    std::copy(tilt, tilt + 4, tilt1);
    speed_scale_error1[0] = speed_scale_error[0];
  }
  void SqrtQ(double dt_s, MatrixRef Lq) const { noise.SqrtQ(dt_s, Lq); }

 private:
  static std::array<double, 4> ReadVehicleFromCam(Params& p) {
    const char* const doc = "orientation of the camera on the vehicle: a unit quaternion";
    const std::array<double, 4> q{p.Number("vehicle_from_cam.orientation.w", "", doc, {}, 1.0),
                                  p.Number("vehicle_from_cam.orientation.x", "", doc, {}, 0.0),
                                  p.Number("vehicle_from_cam.orientation.y", "", doc, {}, 0.0),
                                  p.Number("vehicle_from_cam.orientation.z", "", doc, {}, 0.0)};
    const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    constexpr double kTolerance = 1e-3;
    if (std::abs(norm - 1.0) <= kTolerance) return q;
    p.Fail("vehicle_from_cam.orientation", "does not have unit length (tolerance 1e-3)");
    return {1.0, 0.0, 0.0, 0.0};
  }
};

}  // namespace alidade
