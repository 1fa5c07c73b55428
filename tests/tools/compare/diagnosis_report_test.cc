// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/diagnosis_report.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "support/config_text.h"

namespace alidade {
namespace {

ParameterTest TestOf(const std::string& key, double z, double better) {
  return {.key = key,
          .value = 0.0,
          .z = z,
          .better = better,
          .sigma = 0.00018,
          .gain = 0.5 * z * z,
          .setting = "estimators.ekf.overrides." + key + "=X",
          .alternative_to = {},
          .not_tested = {}};
}

/// Returns the tests of two clock offsets with the same effect.
ParameterTests TestsOfOffsets() {
  ParameterTest first = TestOf("sensors.camera.time_offset_s", 30.25, 0.004684),
                second = TestOf("sensors.mocap.time_offset_s", -30.2, -0.004682);
  second.alternative_to = first.key;
  return {"ekf", {}, {first, second}};
}

std::string TextOf(const ParameterTests& tests) { return ParameterTestsText({&tests, 1}); }

TEST(ParameterTestsText, MarksAParameterWithTheSameEffectAsAnAlternative) {
  EXPECT_EQ(TextOf(TestsOfOffsets()),
            "parameters of ekf:\n"
            "  sensors.camera.time_offset_s is 0, but 0.00468 explains the innovations better "
            "(|z| = 30.2, log-likelihood +458); try --set "
            "'estimators.ekf.overrides.sensors.camera.time_offset_s=X'\n"
            "  sensors.mocap.time_offset_s is 0, but -0.00468 has almost the same effect as "
            "sensors.camera.time_offset_s (|z| = 30.2, log-likelihood +456); try --set "
            "'estimators.ekf.overrides.sensors.mocap.time_offset_s=X'\n"
            "  change only the first of these parameters, and repeat the diagnosis\n");
}

TEST(ParameterTestsText, NamesOnlyTheLargestScoreIfThereIsNoAlarm) {
  const ParameterTests tests = {"ekf", {}, {TestOf("a", -2.5, 1.0), TestOf("b", 1.0, 1.0)}};
  EXPECT_EQ(TextOf(tests),
            "parameters of ekf:\n"
            "  no other value of a parameter explains the innovations significantly better: the "
            "largest |z| of 2 parameters is 2.5 (a), which is below the threshold of 4.5\n");
}

TEST(ParameterTestsText, SaysIfNothingWasTested) {
  ParameterTest constant = TestOf("a", 0.0, 0.0);
  constant.not_tested = "the standard deviation is 0";
  EXPECT_EQ(TextOf({"ekf", {}, {constant}}),
            "parameters of ekf:\n  no parameter could be tested\n"
            "  a: not tested, because the standard deviation is 0\n");
  EXPECT_EQ(TextOf({"ekf", "it is a batch", {}}),
            "parameters of ekf:\n  not tested: it is a batch\n");
}

TEST(DiagnosisJson, MarksAnAlternative) {
  const ParameterTests tests = TestsOfOffsets();
  const EstimatorInnovations innovations = {"ekf", {}};
  const Config json = testing::Read(DiagnosisJson({&innovations, 1}, {&tests, 1}));
  const auto tested = json.root().At("estimators").At("ekf").At("parameters").At("tested").Items();
  ASSERT_EQ(tested.size(), 2u);
  EXPECT_FALSE(tested[0].Find("alternative_to"));
  EXPECT_EQ(tested[1].At("alternative_to").Text(), "sensors.camera.time_offset_s");
}

}  // namespace
}  // namespace alidade
