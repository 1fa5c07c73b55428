// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <array>
#include <cmath>

#include "alidade/testing/jacobians.h"
#include "support/formula_models.h"

namespace alidade {
namespace {

using testing::Blocks;
using testing::FormulaMotionOf;
using testing::LargestDifference;
using testing::Message;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Expects that F and G agree with finite differences, whose error is below 1e-8.
void ExpectJacobians(const SharedMotion& motion, const Blocks& x, const double* u, const double* w,
                     double dt_s) {
  const auto analytic = testing::StepWithJacobians(motion, x, u, w, dt_s);
  const auto numeric = testing::NumericStep(motion, x, u, w, dt_s);
  EXPECT_LT(LargestDifference(analytic.f, numeric.f), 1e-8);
  EXPECT_LT(LargestDifference(analytic.g, numeric.g), 1e-8);
}

/// Returns F or Q = G L L' G' of a step without a control input.
struct Linear {
  RowMajor f, q;
};
Linear Linearise(const SharedMotion& motion, const Blocks& x, double dt_s) {
  const int n = motion->tangent_size(), n_w = motion->noise_size();
  const auto step = testing::StepWithJacobians(motion, x, nullptr, nullptr, dt_s);
  RowMajor l(n_w, n_w);
  EXPECT_EQ(motion->SqrtQ(testing::Pointers(x).data(), nullptr, dt_s, l.data()), Status::kOk);
  const RowMajor g = Eigen::Map<const RowMajor>(step.g.data(), n, n_w) * l;
  return {Eigen::Map<const RowMajor>(step.f.data(), n, n), g * g.transpose()};
}

constexpr const char* kUnicycle = R"yaml(blocks: {p: [x, y], heading: angle}
inputs: {u: [v, omega]}
noise: {kind: continuous, nv: 0.1, nw: 0.05}
)yaml";

TEST(FormulaMotion, AStepHasItsDerivatives) {
  const SharedMotion motion = FormulaMotionOf(std::string(kUnicycle) + R"yaml(
let: {v: u.v + nv, w: u.omega + nw, half: 0.5 * w * dt}
step:
  p: p + v * dt * sinc(half) * [cos(heading + half), sin(heading + half)]
  heading: heading + w * dt
)yaml");
  EXPECT_EQ(motion->noise_size(), 2);
  EXPECT_EQ(motion->input().elements, (std::vector<std::string>{"v", "omega"}));
  const std::array u = {1.5, 0.7}, w = {0.2, -0.1};
  ExpectJacobians(motion, {{1, 2}, {3.1}}, u.data(), w.data(), 0.3);
  // The heading crosses pi, and is wrapped.
  const auto step = testing::StepWithJacobians(motion, {{1, 2}, {3.1}}, u.data(), nullptr, 0.3);
  EXPECT_NEAR(step.next[1][0], 3.1 + 0.21 - 2 * std::acos(-1.0), 1e-15);
}

TEST(FormulaMotion, ARateHasItsDerivatives) {
  const SharedMotion motion = FormulaMotionOf(std::string(kUnicycle) + R"yaml(
rate:
  p: (u.v + nv) * [cos(heading), sin(heading)]
  heading: u.omega + nw
)yaml");
  EXPECT_EQ(motion->noise_size(), 4);  // two terms, because the heading moves the position
  const std::array u = {1.5, 0.7};
  const std::array w = {0.2, -0.1, 0.3, 0.1};
  ExpectJacobians(motion, {{1, 2}, {3.1}}, u.data(), w.data(), 0.3);
}

TEST(FormulaMotion, ARateIsTheArcOfTheUnicycle) {
  const SharedMotion motion = FormulaMotionOf(std::string(kUnicycle) + R"yaml(
rate: {p: "(u.v + nv) * [cos(heading), sin(heading)]", heading: u.omega + nw}
)yaml");
  const std::array u = {1.5, 0.7};
  const double dt = 0.1, half = 0.5 * u[1] * dt;
  const auto step = testing::StepWithJacobians(motion, {{1, 2}, {0.4}}, u.data(), nullptr, dt);
  const double chord = u[0] * dt * std::sin(half) / half;
  // The error of the Runge-Kutta method is v dt (omega dt)^4 / 2880, here 1.2e-9.
  EXPECT_NEAR(step.next[0][0], 1 + chord * std::cos(0.4 + half), 2e-9);
  EXPECT_NEAR(step.next[0][1], 2 + chord * std::sin(0.4 + half), 2e-9);
  EXPECT_NEAR(step.next[1][0], 0.4 + u[1] * dt, 1e-15);
}

TEST(FormulaMotion, ARateHasTheExactQOfWhiteNoise) {
  const double sigma = 0.7, dt = 0.4, q = sigma * sigma;
  const SharedMotion motion = FormulaMotionOf(R"yaml(blocks: {p: number, v: number, a: number}
noise: {jerk: 0.7}
rate: {p: v, v: a, a: jerk}
)yaml");
  EXPECT_EQ(motion->noise_size(), 3);
  const Linear linear = Linearise(motion, {{1}, {2}, {3}}, dt);
  RowMajor expected(3, 3);
  // [BarShalom2001] sec. 6.2.3
  expected << std::pow(dt, 5) / 20, std::pow(dt, 4) / 8, std::pow(dt, 3) / 6,  //
      std::pow(dt, 4) / 8, std::pow(dt, 3) / 3, std::pow(dt, 2) / 2,           //
      std::pow(dt, 3) / 6, std::pow(dt, 2) / 2, dt;
  EXPECT_LT((linear.q - q * expected).cwiseAbs().maxCoeff(), 1e-15);
  expected << 1, dt, dt * dt / 2, 0, 1, dt, 0, 0, 1;
  EXPECT_LT((linear.f - expected).cwiseAbs().maxCoeff(), 1e-15);
}

TEST(FormulaMotion, TheDivisionOfAStepDoesNotChangeQ) {
  const SharedMotion motion = FormulaMotionOf(R"yaml(blocks: {p: [x, y], v: [x, y]}
noise: {ax: 0.7, ay: 0.2}
rate: {p: v, v: "[ax, ay]"}
)yaml");
  const Blocks x = {{1, 2}, {3, 4}};
  const Linear whole = Linearise(motion, x, 0.5), first = Linearise(motion, x, 0.2),
               second = Linearise(motion, x, 0.3);
  const RowMajor sum = second.f * first.q * second.f.transpose() + second.q;
  EXPECT_LT((whole.q - sum).cwiseAbs().maxCoeff(), 1e-15);
}

TEST(FormulaMotion, DiscreteNoiseIsConstantInAStep) {
  const SharedMotion motion = FormulaMotionOf(R"yaml(blocks: {p: number, v: number}
noise: {kind: discrete, a: 0.5}
rate: {p: v, v: a}
)yaml");
  EXPECT_TRUE(motion->discrete_noise());
  EXPECT_EQ(motion->noise_size(), 1);
  const Linear linear = Linearise(motion, {{1}, {2}}, 0.4);
  EXPECT_NEAR(linear.q(0, 0), std::pow(0.5 * 0.08, 2), 1e-17);
  EXPECT_NEAR(linear.q(1, 1), std::pow(0.5 * 0.4, 2), 1e-17);
}

TEST(FormulaMotion, TheRateOfAUnitQuaternionIsAnAngularVelocity) {
  const std::string keys = R"yaml(blocks: {q: unit_quaternion, bias: [x, y, z]}
inputs: {gyro: [x, y, z]}
noise: {nx: 0.1, ny: 0.1, nz: 0.1}
let: {w: "gyro - bias + [nx, ny, nz]"}
)yaml";
  const SharedMotion rate = FormulaMotionOf(keys + "rate: {q: w}\n");
  const SharedMotion step = FormulaMotionOf(keys + "step: {q: 'multiply(q, rotation(w * dt))'}\n");
  const Blocks x = {{0.5, 0.5, -0.5, 0.5}, {0.01, 0.02, -0.03}};
  const std::array u = {0.3, -0.5, 0.7}, w = {0.1, 0.05, -0.02};
  ExpectJacobians(step, x, u.data(), w.data(), 0.2);
  const std::array terms = {0.1, 0.05, -0.02, 0.1, 0.0, 0.2, 0.1, 0.3, 0.1};
  ExpectJacobians(rate, x, u.data(), terms.data(), 0.2);
  const auto a = testing::StepWithJacobians(rate, x, u.data(), nullptr, 0.05);
  const auto b = testing::StepWithJacobians(step, x, u.data(), nullptr, 0.05);
  // The error of the Runge-Kutta method is (|w| dt / 2)^5 / 120, here 3e-11.
  EXPECT_LT(LargestDifference(a.next[0], b.next[0]), 1e-10);
  EXPECT_LT(LargestDifference(a.f, b.f), 1e-9);
}

TEST(FormulaMotion, ABlockWithoutAnExpressionIsConstant) {
  const SharedMotion motion =
      FormulaMotionOf("blocks: {a: number, b: number}\nstep: {a: a + b * dt}\n");
  const auto step = testing::StepWithJacobians(motion, {{1}, {2}}, nullptr, nullptr, 0.5);
  EXPECT_EQ(step.next, (Blocks{{2}, {2}}));
  EXPECT_EQ(step.f, (std::vector<double>{1, 0.5, 0, 1}));
}

TEST(FormulaMotion, AGroupWithoutAnExpressionIsConstant) {
  const std::string keys = "blocks: {v: number, pose: se_3_left, planar: se_2_left}\n";
  const Blocks x = {{1}, {3, 4, 0, 0.5, -0.5, 0.5, 0.5}, {0, 0, 1}};
  for (const char* equation : {"rate: {v: 0}\n", "step: {v: v}\n"}) {
    const SharedMotion motion = FormulaMotionOf(keys + equation);
    const Linear linear = Linearise(motion, x, 0.5);
    EXPECT_LT((linear.f - RowMajor::Identity(10, 10)).cwiseAbs().maxCoeff(), 1e-15) << equation;
    EXPECT_EQ(testing::StepWithJacobians(motion, x, nullptr, nullptr, 0.5).next, x) << equation;
  }
}

TEST(FormulaMotion, AnUnusedDefinitionIsNotEvaluated) {
  const SharedMotion motion =
      FormulaMotionOf("blocks: {v: [x, y]}\nlet: {course: 'atan2(v.y, v.x)'}\nrate: {v: -v}\n");
  const Linear linear = Linearise(motion, {{0, 0}}, 0.1);
  EXPECT_NEAR(linear.f(0, 0), std::exp(-0.1), 1e-7);  // the error is 0.1^5 / 120
}

TEST(FormulaMotion, AListOfOneElementHasItsName) {
  const SharedMotion motion =
      FormulaMotionOf("blocks: {heading: angle}\ninputs: {u: [omega]}\nrate: {heading: u.omega}\n");
  const double u = 0.4;
  const auto step = testing::StepWithJacobians(motion, {{0.1}}, &u, nullptr, 0.5);
  EXPECT_NEAR(step.next[0][0], 0.3, 1e-15);
}

TEST(FormulaMotion, ContinuousNoiseHasNoEffectInNoTime) {
  const SharedMotion motion =
      FormulaMotionOf("blocks: {p: number}\nnoise: {n: 0.7}\nstep: {p: p + n}\n");
  EXPECT_EQ(Linearise(motion, {{1}}, 0.0).q(0, 0), 0.0);
}

TEST(FormulaMotion, ErrorsNameTheKey) {
  const auto error = [](const std::string& yaml) {
    return Message([&] { FormulaMotionOf(yaml); });
  };
  EXPECT_NE(error("blocks: {a: number}\n").find("exactly one of `step` and `rate`"),
            std::string::npos);
  EXPECT_NE(error("blocks: {a: number}\nstep: {a: 1}\nrate: {a: 1}\n").find("exactly one"),
            std::string::npos);
  EXPECT_EQ(error("blocks: {a: [x, y]}\nrate: {a: a.x}\n"),
            "f.yaml:2:11 rate.a: the expression has 1 element; expected 2, as block a");
  EXPECT_NE(error("blocks: {aa: number}\nrate: {ab: 1}\n").find("did you mean 'aa'?"),
            std::string::npos);
  EXPECT_EQ(error("blocks: {a: number}\nnoise: {n: -1}\nrate: {a: n}\n"),
            "f.yaml:2:12 noise.n: a standard deviation is negative; expected a value >= 0");
  EXPECT_EQ(
      error("blocks: {u: unit_vector}\nrate: {u: u}\n"),
      "f.yaml:2:11 rate.u: a block of geometry unit_vector has no rate; expected `step`, or a "
      "block that is a number, a vector, an angle or a unit quaternion");
  EXPECT_EQ(error("blocks: {a: number, dt: number}\nstep: {a: a}\n"),
            "f.yaml:1:25 blocks.dt: the name 'dt' is already used; expected another name");
  EXPECT_EQ(error("blocks: {v: number}\nrate: {v: -v / dt}\n"),
            "f.yaml:2:16 rate.v: the name 'dt' does not exist; expected v");
  EXPECT_EQ(error("blocks: {v: number}\nlet: {f: 1 / dt}\nrate: {v: -v}\n"),
            "f.yaml:2:14 let.f: the name 'dt' does not exist; expected f, v");
}

}  // namespace
}  // namespace alidade
