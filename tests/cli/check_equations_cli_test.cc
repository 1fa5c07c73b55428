// SPDX-License-Identifier: Apache-2.0
//
// `alidade check formula --config FILE` and `alidade check linear --config FILE`.
#include "support/program.h"

namespace alidade::testing {
namespace {

class CheckEquations : public ProgramTest {
 protected:
  /// Checks the models `model` of a config with a robot and one sensor. `rate` contains the
  /// expressions of the robot, and `sensor` the equations of the sensor.
  Outcome Check(const std::string& model, const std::string& rate, const std::string& sensor) {
    Write("equations.yaml", R"yaml(
alidade: 1
state:
  robot:
    model: formula
    blocks: {p: [x, y], heading: angle}
    inputs: {u: [v, omega]}
    noise: {nv: 0.1, nw: 0.05}
    input: {stream: wheels}
    initial: {p: {mean: [0, 0], sigma: 0.3}, heading: {mean: 0, sigma: 0.1}}
    rate: )yaml" + rate + R"yaml(
sensors:
  anchor:
    stream: anchor
    roles: {p: robot.p}
)yaml" + sensor);
    return Call({"check", model, "--config", "equations.yaml"});
  }
  Outcome CheckRate(const std::string& rate) {
    return Check("formula", rate, "    model: formula\n    z: {x: p.x}\n    sigma: {x: 0.1}\n");
  }
  Outcome CheckRange(const std::string& range, const std::string& sigma = "0.1") {
    return Check("formula", kRate,
                 "    model: formula\n    z: {range: '" + range + "'}\n    sigma: {range: '" +
                     sigma + "'}\n");
  }
  Outcome CheckLinear(const std::string& matrix) {
    return Check(
        "linear", kRate,
        "    model: linear\n    z: {d: number}\n    H: {p: " + matrix + "}\n    sigma: {d: 0.1}\n");
  }

  static constexpr const char* kRate =
      "{p: '(u.v + nv) * [cos(heading), sin(heading)]', heading: u.omega + nw}";
};

TEST_F(CheckEquations, PassesEachFormulaOfTheConfig) {
  const Outcome outcome = CheckRange("norm(p - [30, -20])");
  EXPECT_EQ(outcome.code, 0) << outcome.out << outcome.err;
  for (const char* line :
       {"state.robot: formula (motion model of equations.yaml)\n",
        "Step: automatic differentiation; ", "sensors.anchor: formula (sensor of equations.yaml)\n",
        "Predict: automatic differentiation; "}) {
    EXPECT_TRUE(Contains(outcome.out, line)) << line << outcome.out;
  }
}

TEST_F(CheckEquations, FindsAPlaceWithoutDerivative) {
  const Outcome outcome = CheckRange("abs(p.x)");
  EXPECT_EQ(outcome.code, 1) << outcome.out;
  EXPECT_TRUE(Contains(outcome.out, "FAIL     jacobian       Predict: d range / d p.x is "))
      << outcome.out;
  const Outcome motion = CheckRate("{heading: abs(p.x)}");
  EXPECT_EQ(motion.code, 1) << motion.out;
  EXPECT_TRUE(Contains(motion.out, "FAIL     jacobian       Step: d heading / d p.x is "))
      << motion.out;
}

TEST_F(CheckEquations, FindsANoiseThatIsNotDefined) {
  const Outcome outcome = CheckRange("p.x", "sqrt(p.y)");
  EXPECT_EQ(outcome.code, 1) << outcome.out;
  EXPECT_TRUE(Contains(outcome.out, "FAIL     calls          SqrtNoise at p = ")) << outcome.out;
}

TEST_F(CheckEquations, RefusesAnExpressionOfTheWrongSize) {
  const Outcome outcome = CheckRate("{p: u.v + nv}");
  EXPECT_EQ(outcome.code, 78) << outcome.out;
  EXPECT_TRUE(Contains(outcome.err, "error: equations.yaml:11:")) << outcome.err;
  EXPECT_TRUE(Contains(outcome.err, " state.robot.rate.p: ")) << outcome.err;
}

TEST_F(CheckEquations, PassesALinearSensorAndRefusesAMatrixOfTheWrongSize) {
  const Outcome right = CheckLinear("[[1, 2]]");
  EXPECT_EQ(right.code, 0) << right.out << right.err;
  EXPECT_TRUE(Contains(right.out, "sensors.anchor: linear (sensor of equations.yaml)\n"));
  EXPECT_FALSE(Contains(right.out, "state.robot")) << right.out;
  const Outcome wrong = CheckLinear("[[1, 2, 3]]");
  EXPECT_EQ(wrong.code, 78) << wrong.out;
  EXPECT_TRUE(Contains(wrong.err, " sensors.anchor.H.p[0]: ")) << wrong.err;
}

TEST_F(CheckEquations, NeedsAConfigWithSuchAModel) {
  EXPECT_EQ(Call({"check", "formula"}).code, 2);
  const Outcome none = Call({"check", "formula", "--config", "config.yaml"});
  EXPECT_EQ(none.code, 78) << none.out;
}

}  // namespace
}  // namespace alidade::testing
