// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "alidade/estimation/direct_models.h"
#include "motion_models/constant_velocity.h"
#include "motion_models/gauss_markov.h"
#include "support/formula_models.h"

namespace alidade {
namespace {

using testing::Blocks;
using testing::LargestDifference;
using testing::LinearMotionOf;
using testing::Message;
using testing::ProcessNoise;
using Numbers = std::vector<double>;

constexpr double kLinearTolerance = 1e-12;

/// Expects equal f, F and Q of a motion model and of its matrices.
void ExpectTwin(const SharedMotion& motion, const std::string& yaml, const Blocks& x, double dt_s) {
  const SharedMotion twin = LinearMotionOf(yaml);
  const auto expected = testing::StepWithJacobians(motion, x, nullptr, nullptr, dt_s);
  const auto step = testing::StepWithJacobians(twin, x, nullptr, nullptr, dt_s);
  for (std::size_t i = 0; i < x.size(); ++i) {
    EXPECT_LT(LargestDifference(step.next[i], expected.next[i]), kLinearTolerance) << dt_s;
  }
  EXPECT_LT(LargestDifference(step.f, expected.f), kLinearTolerance) << dt_s;
  EXPECT_LT(LargestDifference(ProcessNoise(twin, x, nullptr, dt_s),
                              ProcessNoise(motion, x, nullptr, dt_s)),
            kLinearTolerance)
      << dt_s;
}

constexpr const char* kPlane = R"yaml(blocks: {position: [x, y], velocity: [x, y]}
rate:
  A: [[0, 0, 1, 0], [0, 0, 0, 1], [0, 0, 0, 0], [0, 0, 0, 0]]
  G: [[0, 0], [0, 0], [1, 0], [0, 1]]
noise: {sigma: 0.7}
)yaml";

TEST(LinearMotion, ARateOfConstantVelocityIsThatModel) {
  for (const double dt_s : {0.0, 1e-3, 0.1, 0.4, 3.0}) {
    ExpectTwin(MakeMotion(ConstantVelocity<2, true>(0.7)), kPlane, {{1, 2}, {3, -4}}, dt_s);
  }
}

TEST(LinearMotion, ARateOfAGaussMarkovProcessIsThatModel) {
  for (const double dt_s : {0.0, 1e-3, 0.1, 2.0, 1e3}) {
    ExpectTwin(MakeMotion(GaussMarkov<2>(2, 0.5, 0.3)), R"yaml(blocks: {value: [a, b]}
constants: {tau: 0.5, sigma: 0.3}
rate: {A: [[-1 / tau, 0], [0, -1 / tau]]}
noise: {sigma: sigma * sqrt(2 / tau)}
)yaml",
               {{1, 2}}, dt_s);
  }
}

TEST(LinearMotion, AStepOfConstantVelocityIsThatModelAtItsPeriod) {
  const std::string yaml = R"yaml(blocks: {position: number, velocity: number}
constants: {dt: 0.2}
step: {period_s: 0.2, A: [[1, dt], [0, 1]], G: [dt^2 / 2, dt]}
noise: {sigma: 0.7}
)yaml";
  ExpectTwin(MakeMotion(ConstantVelocity<1, false>(0.7)), yaml, {{1}, {3}}, 0.2);
  const SharedMotion motion = LinearMotionOf(yaml);
  // Three periods: F^3, and the sum of F^i Q F^i'.
  const auto step = testing::StepWithJacobians(motion, {{1}, {3}}, nullptr, nullptr, 0.6);
  EXPECT_LT(LargestDifference(step.f, {1, 0.6, 0, 1}), 1e-15);
  const double q = 0.49 * 0.04;  // of the velocity in one period, (m/s)^2
  // Each period moves the position by dt (1/2 + the number of the following periods) per m/s.
  const double pp = q * 0.04 * (0.25 + 2.25 + 6.25), pv = q * 0.2 * (0.5 + 1.5 + 2.5);
  EXPECT_LT(LargestDifference(ProcessNoise(motion, {{1}, {3}}, nullptr, 0.6), {pp, pv, pv, 3 * q}),
            1e-15);
}

TEST(LinearMotion, AStepRejectsOtherPeriods) {
  const SharedMotion motion =
      LinearMotionOf("blocks: {p: number}\nstep: {period_s: 0.2, A: 0.5}\nnoise: {sigma: 1}\n");
  const double x = 8.0;
  const std::array blocks = {&x};
  double next = 0.0;
  double* const destination[] = {&next};
  const auto step = [&](double dt_s) {
    return motion->Step(blocks.data(), nullptr, nullptr, dt_s, {.next = destination});
  };
  EXPECT_EQ(step(0.4015), Status::kOk);  // two periods within 1 % of one
  EXPECT_EQ(next, 2.0);
  EXPECT_EQ(step(0.0), Status::kOk);
  EXPECT_EQ(next, 8.0);
  for (const double dt_s : {0.403, 0.1, -0.2}) EXPECT_EQ(step(dt_s), Status::kError) << dt_s;
  EXPECT_EQ(step(0.1), Status::kError);
  EXPECT_EQ(motion->error_text(),
            "dt is 0.1 s, which is not a multiple of step.period_s = 0.2; use the form `rate`");
}

TEST(LinearMotion, ItsInputIsConstantOverTheStep) {
  // A point with friction c: v' = v e^-c dt + u (1 - e^-c dt) / c.
  const SharedMotion motion = LinearMotionOf(R"yaml(blocks: {p: number, v: number}
inputs: {u: number}
constants: {c: 0.8}
rate: {A: [[0, 1], [0, -c]], B: [0, 1]}
)yaml");
  EXPECT_EQ(motion->noise_size(), 0);
  const double u = 1.5, c = 0.8;
  for (const double dt : {0.01, 0.7, 20.0}) {
    const double e = std::exp(-c * dt), a = -std::expm1(-c * dt) / c;
    const auto step = testing::StepWithJacobians(motion, {{1}, {3}}, &u, nullptr, dt);
    EXPECT_NEAR(step.next[0][0], 1 + 3 * a + u * (dt - a) / c, 1e-13);
    EXPECT_NEAR(step.next[1][0], 3 * e + u * a, 1e-13);
  }
}

TEST(LinearMotion, TheDivisionOfAStepChangesNothing) {
  const SharedMotion motion = LinearMotionOf(R"yaml(blocks: {p: [x, y], v: number}
rate: {A: [[-1, 2, 0.3], [-4, 0.5, 1], [0.2, -0.7, -3]]}
noise: {covariance: [[2, 0.5, 0], [0.5, 1, 0], [0, 0, 0.3]]}
)yaml");
  const Blocks x = {{1, -2}, {3}};
  const auto matrix = [](const Numbers& numbers) {
    return Eigen::Matrix3d(Eigen::Map<const Eigen::Matrix3d>(numbers.data()).transpose());
  };
  const auto f = [&](double dt) {
    return matrix(testing::StepWithJacobians(motion, x, nullptr, nullptr, dt).f);
  };
  const auto q = [&](double dt) { return matrix(ProcessNoise(motion, x, nullptr, dt)); };
  const Eigen::Matrix3d f2 = f(0.5);
  EXPECT_LT((f(0.8) - f2 * f(0.3)).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_LT((q(0.8) - f2 * q(0.3) * f2.transpose() - q(0.5)).cwiseAbs().maxCoeff(), 1e-14);
  // dQ/dt = A Q + Q A' + Q_c at dt = 0
  EXPECT_LT((q(1e-7) * 1e7 - q(1e-9) * 1e9).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_NEAR(q(1e-9)(0, 1) * 1e9, 0.5, 1e-7);
}

TEST(LinearMotion, AFastModeDoesNotOverflow) {
  const SharedMotion motion =
      LinearMotionOf("blocks: {p: number}\nrate: {A: -1e6}\nnoise: {sigma: 1}\n");
  EXPECT_NEAR(ProcessNoise(motion, {{1}}, nullptr, 60.0)[0], 0.5e-6, 1e-15);
}

TEST(LinearMotion, ReportsWrongMatrices) {
  const auto message = [](const std::string& yaml) {
    return Message([&] { LinearMotionOf("blocks: {p: [x, y], v: number}\n" + yaml); });
  };
  EXPECT_EQ(message("rate: {A: [[1, 2], [3, 4]]}\n"),
            "f.yaml:2:11 rate.A: the matrix A has 2 rows; expected 3 rows of 3 numbers");
  EXPECT_EQ(message("rate:\n  A:\n    - [1, 2, 3]\n    - [3, 4]\n    - [5, 6, 7]\n"),
            "f.yaml:5:7 rate.A[1]: a row of the matrix A has 2 numbers; "
            "expected 3 rows of 3 numbers");
  const std::string a = "A: [[0, 0, 0], [0, 0, 0], [0, 0, 0]]";
  EXPECT_EQ(
      message("rate: {" + a + ", B: [1, 2, 3]}\n"),
      "f.yaml:2:49 rate.B: the model has no control input; expected the key `inputs`, such as "
      "inputs: {u: [x, y]}");
  EXPECT_EQ(message("inputs: {u: number}\nrate: {" + a + ", B: [1, 2]}\n"),
            "f.yaml:3:49 rate.B: the matrix B has 2 rows; expected 3 rows of 1 number");
  EXPECT_EQ(message("rate: {" + a + ", G: [1, 2, 3]}\nnoise: {sigma: [1, 2]}\n"),
            "f.yaml:3:16 noise.sigma: the list has 2 elements; expected 1, or one number for all "
            "elements");
  EXPECT_NE(
      message("rate: {" + a + ", G: [1, 2, 3]}\n").find("missing key, needed by the matrix G"),
      std::string::npos);
  EXPECT_NE(message("step: {" + a + "}\n").find("period_s"), std::string::npos);
  EXPECT_NE(message(a + "\n").find("exactly one of `step` and `rate`"), std::string::npos);
  EXPECT_EQ(Message([] { LinearMotionOf("blocks: {q: unit_quaternion}\nrate: {A: 1}\n"); }),
            "f.yaml:1:9 blocks: 'q' has geometry unit_quaternion; expected numbers and vectors, or "
            "the model formula");
}

}  // namespace
}  // namespace alidade
