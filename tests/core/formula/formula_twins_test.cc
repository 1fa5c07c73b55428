// SPDX-License-Identifier: Apache-2.0
//
// Compares formulas with the compiled models of the same equation.
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "alidade/estimation/direct_models.h"
#include "alidade/testing/jacobians.h"
#include "motion_models/constant.h"
#include "motion_models/constant_acceleration.h"
#include "motion_models/constant_velocity.h"
#include "motion_models/coordinated_turn.h"
#include "motion_models/gauss_markov.h"
#include "motion_models/quaternion_pose.h"
#include "motion_models/unicycle.h"
#include "sensors/altitude.h"
#include "sensors/bearing.h"
#include "sensors/pose.h"
#include "sensors/position.h"
#include "sensors/pseudorange.h"
#include "sensors/radar.h"
#include "sensors/range.h"
#include "sensors/range_bearing.h"
#include "sensors/relative_pose.h"
#include "sensors/scale_2d.h"
#include "sensors/stereo_disparity.h"
#include "support/formula_models.h"

namespace alidade {
namespace {

using testing::Blocks;
using testing::FormulaMotionOf;
using testing::FormulaSensorOf;
using testing::LargestDifference;
using testing::ProcessNoise;

constexpr double kTolerance = 1e-12;

/// Expects equal h, H and L of a sensor and of its formula, whose roles are those of the sensor.
void ExpectTwinSensor(const SharedSensor& sensor, const std::string& yaml, const Blocks& roles,
                      const double* known = nullptr) {
  std::vector<Space> spaces = sensor->roles();
  for (Space& space : spaces) space.flags = 0;
  const SharedSensor twin = FormulaSensorOf(yaml, spaces);
  EXPECT_EQ(twin->measurement().geometry, sensor->measurement().geometry);
  EXPECT_LT(LargestDifference(testing::PredictionOf(twin, roles, known),
                              testing::PredictionOf(sensor, roles, known)),
            kTolerance);
  EXPECT_LT(LargestDifference(testing::SensorJacobian(twin, roles, known),
                              testing::SensorJacobian(sensor, roles, known)),
            kTolerance);
  const int m = sensor->measurement().geometry.tangent;
  std::vector<double> l(static_cast<std::size_t>(m * m)), twin_l = l;
  const auto pointers = testing::Pointers(roles);
  EXPECT_EQ(sensor->SqrtNoise(pointers.data(), nullptr, l.data(), known), Status::kOk);
  EXPECT_EQ(twin->SqrtNoise(pointers.data(), nullptr, twin_l.data(), known), Status::kOk);
  EXPECT_LT(LargestDifference(twin_l, l), kTolerance);
}

/// Expects equal f, F and Q of a motion model and of its formula.
void ExpectTwinMotion(const SharedMotion& motion, const std::string& yaml, const Blocks& x,
                      double dt_s, const double* u = nullptr) {
  const SharedMotion twin = FormulaMotionOf(yaml);
  const auto expected = testing::StepWithJacobians(motion, x, u, nullptr, dt_s);
  const auto step = testing::StepWithJacobians(twin, x, u, nullptr, dt_s);
  for (std::size_t i = 0; i < x.size(); ++i) {
    EXPECT_LT(LargestDifference(step.next[i], expected.next[i]), kTolerance) << i;
  }
  EXPECT_LT(LargestDifference(step.f, expected.f), kTolerance);
  EXPECT_LT(LargestDifference(ProcessNoise(twin, x, u, dt_s), ProcessNoise(motion, x, u, dt_s)),
            kTolerance);
  EXPECT_EQ(twin->discrete_noise(), motion->discrete_noise());
}

TEST(FormulaTwins, StereoDisparity) {
  ExpectTwinSensor(MakeSensor(StereoDisparity(400, 0.065, 1.5)),
                   "constants: {bf: 400 * 0.065}\nz: {disparity: bf / depth}\n"
                   "domain: depth > 0\nsigma: {disparity: 1.5}\n",
                   {{0.35}});
}

TEST(FormulaTwins, Scale2d) {
  ExpectTwinSensor(MakeSensor(Scale2d::FromPixels(300, 1)),
                   "let: {s: inverse_distance * depth}\nz: {inverse_scale: s}\n"
                   "domain: depth > 0 and inverse_distance > 0\n"
                   "sigma: {inverse_scale: 2 / 300 * s^3}\n",
                   {{0.35}, {3.1}});
}

TEST(FormulaTwins, Pose) {
  ExpectTwinSensor(MakeSensor(Pose<3>({0.1, 0.2, 0.3}, {0.01, 0.02, 0.03})),
                   "z: {position: position, orientation: orientation}\n"
                   "sigma: {position: [0.1, 0.2, 0.3], orientation: [0.01, 0.02, 0.03]}\n",
                   {{1, 2, 3}, {0.5, -0.5, 0.5, 0.5}});
}

TEST(FormulaTwins, RelativePose) {
  ExpectTwinSensor(MakeSensor(RelativePose<3>({0.1, 0.2, 0.3}, {0.01, 0.02, 0.03})),
                   "z:\n  position: rotate_inverse(orientation, landmark_position - position)\n"
                   "  orientation: multiply(conjugate(orientation), landmark_orientation)\n"
                   "sigma: {position: [0.1, 0.2, 0.3], orientation: [0.01, 0.02, 0.03]}\n",
                   {{1, 2, 3}, {0.5, -0.5, 0.5, 0.5}, {-2, 5, 1}, {0.8, 0.6, 0, 0}});
}

TEST(FormulaTwins, RangeBearing) {
  ExpectTwinSensor(MakeSensor(RangeBearing<Xyz>(0.1, 0.02)),
                   "let:\n  h: rotate_inverse(orientation, landmark - position)\n"
                   "z: {range: norm(h), bearing: unit(h)}\nsigma: {range: 0.1, bearing: 0.02}\n",
                   {{1, 2, 3}, {0.5, -0.5, 0.5, 0.5}, {-2, 5, 1}});
}

TEST(FormulaTwins, Pseudorange) {
  const std::array<double, 3> transmitter = {1.3e7, -2.1e7, 0.4e7};
  ExpectTwinSensor(MakeSensor(Pseudorange(2.5)),
                   "known: {transmitter: [x, y, z]}\n"
                   "z: {pseudorange: norm(position - transmitter) + clock_bias}\n"
                   "sigma: {pseudorange: 2.5}\n",
                   {{100, -200, 300}, {45}}, transmitter.data());
}

TEST(FormulaTwins, PlanarPose) {
  ExpectTwinSensor(MakeSensor(Pose<2>({0.1, 0.2}, {0.03})),
                   "z: {position: position, heading: heading}\n"
                   "sigma: {position: [0.1, 0.2], heading: 0.03}\n",
                   {{1, 2}, {3}});
}

TEST(FormulaTwins, PlanarRelativePose) {
  ExpectTwinSensor(MakeSensor(RelativePose<2>({0.1, 0.2}, {0.03})), R"yaml(
let: {d: landmark_position - position, c: cos(heading), s: sin(heading)}
z:
  position: [c * d.x + s * d.y, c * d.y - s * d.x]
  heading: wrap(landmark_heading - heading)
sigma: {position: [0.1, 0.2], heading: 0.03}
)yaml",
                   {{1, 2}, {3}, {-2, 5}, {-3}});
}

TEST(FormulaTwins, Position) {
  ExpectTwinSensor(MakeSensor(Position<3>({0.1, 0.2, 0.3})),
                   "z: {position: 'position + rotate(orientation, lever_arm)'}\n"
                   "sigma: {position: [0.1, 0.2, 0.3]}\n",
                   {{1, 2, 3}, {0.5, -0.5, 0.5, 0.5}, {0.3, 0.2, -0.1}});
}

TEST(FormulaTwins, Range) {
  const std::array point = {7.0, -5.0};
  ExpectTwinSensor(MakeSensor(RangeToPoint<2>(0.1)), R"yaml(
known: {point: [x, y]}
let: {l: lever_arm, c: cos(heading), s: sin(heading)}
z: {range: "norm(position + [c * l.x - s * l.y, s * l.x + c * l.y] - point) + bias"}
sigma: {range: 0.1}
)yaml",
                   {{1, 2}, {3}, {0.3, 0.2}, {0.4}}, point.data());
}

TEST(FormulaTwins, Bearing) {
  const std::array point = {7.0, -5.0};
  ExpectTwinSensor(MakeSensor(Bearing(0.01)), R"yaml(
known: {point: [x, y]}
let:
  d: point - position
  x: cos(heading) * d.x + sin(heading) * d.y - lever_arm.x
  y: cos(heading) * d.y - sin(heading) * d.x - lever_arm.y
  c: cos(mounting)
  s: sin(mounting)
z: {bearing: "atan2(c * y - s * x, c * x + s * y)"}
sigma: {bearing: 0.01}
)yaml",
                   {{1, 2}, {3}, {0.3, 0.2}, {-0.4}}, point.data());
}

TEST(FormulaTwins, RangeBearingToPoint) {
  const std::array point = {7.0, -5.0, 2.0};
  ExpectTwinSensor(MakeSensor(RangeBearingToPoint<3>(0.1, 0.02)), R"yaml(
known: {point: [x, y, z]}
let: {h: "rotate_inverse(mounting, rotate_inverse(orientation, point - position) - lever_arm)"}
z: {range: norm(h), bearing: unit(h)}
sigma: {range: 0.1, bearing: 0.02}
)yaml",
                   {{1, 2, 3}, {0.5, -0.5, 0.5, 0.5}, {0.3, 0.2, -0.1}, {0.8, 0.6, 0, 0}},
                   point.data());
}

// With 1 Pa at the height 0, rounding errors of the pressure are below the tolerance.
TEST(FormulaTwins, Altitude) {
  ExpectTwinSensor(MakeSensor(Altitude<3, true>(20, 1)),
                   "z: {pressure: (1 - 2.255770e-5 * position.z) ^ 5.255880 + bias}\n"
                   "sigma: {pressure: 20}\n",
                   {{1, 2, 1500}, {0.25}});
}

TEST(FormulaTwins, Constant) {
  ExpectTwinMotion(MakeMotion(Constant<2>(2, 0.3)),
                   "blocks: {value: [a, b]}\nnoise: {wa: 0.3, wb: 0.3}\n"
                   "rate: {value: '[wa, wb]'}\n",
                   {{1, 2}}, 0.4);
}

TEST(FormulaTwins, ConstantVelocityWithContinuousNoise) {
  ExpectTwinMotion(MakeMotion(ConstantVelocity<2, true>(0.7)),
                   "blocks: {position: [x, y], velocity: [x, y]}\nnoise: {ax: 0.7, ay: 0.7}\n"
                   "rate: {position: velocity, velocity: '[ax, ay]'}\n",
                   {{1, 2}, {3, -4}}, 0.4);
}

TEST(FormulaTwins, ConstantVelocityWithDiscreteNoise) {
  ExpectTwinMotion(MakeMotion(ConstantVelocity<1, false>(0.7)),
                   "blocks: {position: number, velocity: number}\n"
                   "noise: {kind: discrete, a: 0.7}\nrate: {position: velocity, velocity: a}\n",
                   {{1}, {3}}, 0.4);
}

TEST(FormulaTwins, ConstantAcceleration) {
  ExpectTwinMotion(MakeMotion(ConstantAcceleration<2, true>(0.7)),
                   "blocks: {p: [x, y], v: [x, y], a: [x, y]}\nnoise: {jx: 0.7, jy: 0.7}\n"
                   "rate: {p: v, v: a, a: '[jx, jy]'}\n",
                   {{1, 2}, {3, -4}, {5, 6}}, 0.4);
}

// A noise of the formula has the variance sigma^2 / dt.
TEST(FormulaTwins, GaussMarkov) {
  ExpectTwinMotion(MakeMotion(GaussMarkov<2>(2, 5, 0.3)), R"yaml(
blocks: {value: [a, b]}
noise: {wa: 0.3, wb: 0.3}
let: {decay: exp(-dt / 5), gain: sqrt(dt * (1 - decay^2))}
step: {value: "decay * value + gain * [wa, wb]"}
)yaml",
                   {{1, -2}}, 0.4);
}

TEST(FormulaTwins, CoordinatedTurn) {
  ExpectTwinMotion(MakeMotion(CoordinatedTurn(0.5, 0.2)), R"yaml(
blocks: {position: [x, y], heading: angle, speed: number, turn_rate: number}
noise: {a1: 0.5, a2: 0.5, b1: 0.2, b2: 0.2}
let:
  s: dt * speed + dt^2 / sqrt(3) * a1
  phi: dt * turn_rate + dt^2 / sqrt(3) * b1
  middle: heading + 0.5 * phi
step:
  position: position + s * sinc(0.5 * phi) * [cos(middle), sin(middle)]
  heading: heading + phi
  speed: speed + 0.5 * dt * (sqrt(3) * a1 + a2)
  turn_rate: turn_rate + 0.5 * dt * (sqrt(3) * b1 + b2)
)yaml",
                   {{1, 2}, {3.1}, {4}, {0.7}}, 0.4);
}

TEST(FormulaTwins, Unicycle) {
  const std::array u = {1.5, 0.7};
  ExpectTwinMotion(MakeMotion(Unicycle(NoiseKind::kContinuous, 0.1, 0.05)), R"yaml(
blocks: {p: [x, y], heading: angle}
inputs: {u: [v, omega]}
noise: {nv: 0.1, nw: 0.05}
let: {s: (u.v + nv) * dt, phi: (u.omega + nw) * dt, middle: heading + 0.5 * phi}
step:
  p: p + s * sinc(0.5 * phi) * [cos(middle), sin(middle)]
  heading: heading + phi
)yaml",
                   {{1, 2}, {3.1}}, 0.4, u.data());
}

TEST(FormulaTwins, Radar) {
  ExpectTwinSensor(MakeSensor(Radar<2, true, true, true>({5, 0.01, 0.3})), R"yaml(
let: {h: position - radar_position, d: norm(h)}
z:
  range: d
  azimuth: atan2(h.y, h.x)
  range_rate: dot(h, velocity - radar_velocity) / d
sigma: {range: 5, azimuth: 0.01, range_rate: 0.3}
)yaml",
                   {{300, 200}, {-10, 5}, {1, -2}, {0.5, 0.2}});
}

TEST(FormulaTwins, QuaternionPose) {
  ExpectTwinMotion(MakeMotion(QuaternionPose({0.1, 0.2, 0.3}, {0.4, 0.5, 0.6})), R"yaml(
blocks: {r: [x, y, z], q: unit_quaternion, v: [x, y, z], omega: [x, y, z]}
noise: {kind: discrete, ax: 0.1, ay: 0.2, az: 0.3, bx: 0.4, by: 0.5, bz: 0.6}
let: {v1: "v + dt * [ax, ay, az]", omega1: "omega + dt * [bx, by, bz]"}
step:
  r: r + dt * v1
  q: multiply(q, rotation(dt * omega1))
  v: v1
  omega: omega1
)yaml",
                   {{1, 2, 3}, {0.5, -0.5, 0.5, 0.5}, {4, 5, 6}, {0.3, -0.2, 0.7}}, 0.4);
}

}  // namespace
}  // namespace alidade
