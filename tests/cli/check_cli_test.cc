// SPDX-License-Identifier: Apache-2.0
#include "support/program.h"

namespace alidade::testing {
namespace {

class CheckProgram : public ProgramTest {};

const Arguments kStereo = {"check", "stereo_disparity", "--set", "focal_px=400",
                           "--set", "baseline_m=0.065", "--set", "sigma_px=1"};

Arguments With(Arguments arguments, const Arguments& more) {
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

TEST_F(CheckProgram, SaysALineForEachCheckAndEndsWithZero) {
  const Outcome outcome = Call(kStereo);
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_TRUE(outcome.out.starts_with("stereo_disparity (sensor of /")) << outcome.out;
  for (const char* line : {"\n  ok       create ", "\n  ok       jacobian ",
                           "\n  skipped  step           the model is not a motion model\n"}) {
    EXPECT_TRUE(Contains(outcome.out, line)) << line << outcome.out;
  }
  EXPECT_FALSE(Contains(outcome.out, "FAIL"));
}

TEST_F(CheckProgram, SaysWhichJacobiansAreAnalytic) {
  const Outcome stereo = Call(kStereo);
  EXPECT_TRUE(Contains(stereo.out,
                       "Predict: analytic Jacobian, Initialise: automatic "
                       "differentiation; "))
      << stereo.out;
  const Outcome pose =
      Call({"check", "quaternion_pose", "--set", "noise.kind=discrete", "--set",
            "noise.linear_acceleration=0.4", "--set", "noise.angular_acceleration=0.2"});
  EXPECT_TRUE(Contains(pose.out, "Step: automatic differentiation; ")) << pose.out;
  const Outcome motion = Call({"check", "constant"});
  EXPECT_TRUE(Contains(motion.out, "Step: analytic Jacobian; ")) << motion.out;
}

TEST_F(CheckProgram, EndsWithOneWhereACheckFails) {
  // The timeout is so short that the first call exceeds it.
  const Outcome outcome = Call(With(kStereo, {"--states", "100000", "--timeout", "0.01"}));
  EXPECT_EQ(outcome.code, 1) << outcome.out;
  EXPECT_TRUE(Contains(outcome.out, "\n  FAIL ")) << outcome.out;
  EXPECT_TRUE(Contains(outcome.out, "the check took longer than 0.01 s (--timeout); it was "))
      << outcome.out;
}

TEST_F(CheckProgram, TakesANoiseThatIsGivenAsACovariance) {
  const Outcome sensor =
      Call({"check", "pose", "--set",
            "covariance=[[4, 1, 0, 0, 0, 0], [1, 4, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0], [0, 0, 0, 1, "
            "0, 0], [0, 0, 0, 0, 1, 0], [0, 0, 0, 0, 0, 1]]"});
  EXPECT_EQ(sensor.code, 0) << sensor.out << sensor.err;
  const Outcome motion = Call({"check", "constant_velocity", "--set", "noise.kind=discrete",
                               "--set", "noise.covariance=[[4]]"});
  EXPECT_EQ(motion.code, 0) << motion.out << motion.err;
  const Outcome both = Call(With(kStereo, {"--set", "covariance=[[4]]"}));
  EXPECT_EQ(both.code, 78) << both.out;
  EXPECT_TRUE(Contains(both.err, "sigma_px: the entry also defines the noise by `covariance`"))
      << both.err;
}

TEST_F(CheckProgram, NamesParametersThatAreMissingOrUnknown) {
  const Outcome missing = Call({"check", "stereo_disparity", "--set", "focal_px=400"});
  EXPECT_EQ(missing.code, 78);
  EXPECT_TRUE(Contains(missing.err, "model 'stereo_disparity': baseline_m: missing"))
      << missing.err;
  EXPECT_TRUE(Contains(missing.err, "model 'stereo_disparity': sigma_px: missing")) << missing.err;
  EXPECT_FALSE(Contains(missing.err, ":1:1")) << missing.err;
  EXPECT_TRUE(Contains(missing.err, "\n  to set a parameter, use --set KEY=VALUE"));
  const Outcome unknown = Call(With(kStereo, {"--set", "min_range=1"}));
  EXPECT_EQ(unknown.code, 78) << unknown.out;
  EXPECT_TRUE(Contains(unknown.err, "error: --set")) << unknown.err;
  EXPECT_TRUE(Contains(unknown.err, "min_range: unknown key")) << unknown.err;
  EXPECT_TRUE(Contains(unknown.err, "did you mean 'min_range_m'?")) << unknown.err;
}

TEST_F(CheckProgram, TakesParametersFromTheConfigOfARun) {
  const Outcome outcome = Call({"check", "stereo_disparity", "--config", "config.yaml"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(outcome.out.starts_with("sensors.stereo: stereo_disparity (sensor of "))
      << outcome.out;
  const Outcome motion = Call({"check", "constant_velocity", "--config", "config.yaml"});
  EXPECT_TRUE(motion.out.starts_with("state.target: constant_velocity (")) << motion.out;
  const Outcome none = Call({"check", "scale_2d", "--config", "table.yaml"});
  EXPECT_EQ(none.code, 78);
  EXPECT_TRUE(Contains(none.err, "error: table.yaml")) << none.err;
  EXPECT_TRUE(Contains(none.err, "uses a model of the plugin; expected an entry with model: "))
      << none.err;
  EXPECT_EQ(Call(With(kStereo, {"--config", "config.yaml"})).code, 2);
}

TEST_F(CheckProgram, SetsParametersOfSeveralModelsByTheirNames) {
  const std::string several = ALIDADE_BINARY_DIR "/tests/plugins/matrix_baseline.so";
  if (!fs::exists(several)) GTEST_SKIP() << "this plugin is built only together with test_plugins";
  const Outcome plain = Call({"check", several, "--set", "gain=1"});
  EXPECT_EQ(plain.code, 78);
  EXPECT_TRUE(
      Contains(plain.err, "error: --set gain: the model is missing; expected MODEL.key=value"))
      << plain.err;
  const Outcome one = Call({"check", several, "matrix_sensor", "--set", "gain=1"});
  EXPECT_EQ(one.code, 0) << one.out << one.err;
  const Outcome named = Call({"check", several, "--set", "matrix_sensor.gain=abc"});
  EXPECT_EQ(named.code, 78);
  EXPECT_TRUE(Contains(named.err, "error: --set")) << named.err;
}

TEST_F(CheckProgram, SaysWhichPluginsAreMissingOrRefused) {
  const Outcome missing = Call({"check", "stereo"});
  EXPECT_EQ(missing.code, 69);
  EXPECT_TRUE(Contains(missing.err, "error: no sensor or motion model was found for 'stereo'"));
  const Outcome file = Call({"check", "./nowhere.so"});
  EXPECT_EQ(file.code, 69);
  EXPECT_TRUE(Contains(file.err, "nowhere.so: no such file or folder")) << file.err;
  EXPECT_TRUE(Contains(missing.err, "\n  searched /")) << missing.err;
  const Outcome source = Call({"check", "tables"});
  EXPECT_EQ(source.code, 69);
  EXPECT_EQ(source.err, "error: 'tables' is a source; expected a sensor or motion model\n");
  const Outcome built_in = Call({"check", "ekf"});
  EXPECT_EQ(built_in.code, 69);
  EXPECT_TRUE(built_in.err.starts_with("error: 'ekf' is a built-in estimator; expected a sensor "))
      << built_in.err;
  EXPECT_EQ(Call({"check"}).code, 2);
  const Outcome states = Call(With(kStereo, {"--states", "0"}));
  EXPECT_EQ(states.code, 2);
  EXPECT_TRUE(Contains(states.err, "'0' is not an integer from 1 to 1000000")) << states.err;
  const Outcome timeout = Call(With(kStereo, {"--timeout", "0"}));
  EXPECT_TRUE(Contains(timeout.err, "'0' is not a number from 0.01 to 1e+06")) << timeout.err;
}

}  // namespace
}  // namespace alidade::testing
