// SPDX-License-Identifier: Apache-2.0
#include "support/program.h"

namespace alidade {
namespace {

using testing::Arguments;
using testing::Contains;
using testing::Outcome;

class DiagnoseCli : public testing::ProgramTest {
 protected:
  /// Runs config.yaml with settings, and returns the outcome of `diagnose`.
  Outcome Diagnose(const Arguments& settings, const Arguments& options = {}) const {
    Arguments run = {"run", "config.yaml", "-o", "out", "--force", "--no-figures", "--quiet"};
    for (const std::string& setting : settings) run.insert(run.end(), {"--set", setting});
    EXPECT_EQ(Call(run).code, 0) << Read("stderr");
    Arguments diagnose = {"diagnose", "out"};
    diagnose.insert(diagnose.end(), options.begin(), options.end());
    return Call(diagnose);
  }
};

TEST_F(DiagnoseCli, FindsNothingInACleanRun) {
  const Outcome outcome = Diagnose({});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "diagnosis of ekf:\n  nothing found\n");
}

TEST_F(DiagnoseCli, NamesTheSensorWhoseSigmaIsTooSmall) {
  const Outcome outcome = Diagnose({"sensors.stereo.sigma_px=0.5"});
  EXPECT_EQ(outcome.code, 0) << "a finding is not an error";
  EXPECT_TRUE(outcome.out.starts_with("diagnosis of ekf:\n  stereo: ")) << outcome.out;
  EXPECT_TRUE(Contains(outcome.out,
                       "times as large as predicted, so sigma or the process noise "
                       "is too small"))
      << outcome.out;
}

TEST_F(DiagnoseCli, FindsTheSameAsTheRun) {
  const Outcome outcome = Diagnose(
      {"sensors.stereo.sigma_px=0.5", "estimators.two={type: ekf, sensors: [stereo]}"}, {"--json"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  const Config found = Config::FromText(outcome.out, "stdout"), run = Json("out/run.json");
  for (const char* estimator : {"ekf", "two"}) {
    const auto diagnosis_of = [&](const Config& json) {
      std::string text;
      const Node entry = json.root().At("estimators").At(estimator);
      for (const Node& finding : entry.At("diagnosis").Items()) {
        text += finding.At("code").Text() + ' ' + finding.At("text").Text() + '\n';
      }
      return text;
    };
    EXPECT_TRUE(Contains(diagnosis_of(found), "overconfident stereo: ")) << outcome.out;
    EXPECT_EQ(diagnosis_of(found), diagnosis_of(run));
  }
}

TEST_F(DiagnoseCli, NamesTheSensorsThatItCannotTest) {
  const Arguments short_run = {"source.duration_s=0.5"};
  const Outcome text = Diagnose(short_run);
  EXPECT_TRUE(Contains(text.out, "scale: not tested, because accepted measurements have only "))
      << text.out;
  EXPECT_FALSE(Contains(text.out, "nothing found")) << text.out;
  const Config json = Config::FromText(Call({"diagnose", "out", "--json"}).out, "stdout");
  const auto sensors = json.root().At("estimators").At("ekf").At("not_tested").Items();
  ASSERT_EQ(sensors.size(), 2u);
  EXPECT_EQ(sensors[0].Text(), "stereo");
}

TEST_F(DiagnoseCli, RefusesAFolderThatIsNotAFinishedRun) {
  const Outcome missing = Call({"diagnose", "missing"});
  EXPECT_EQ(missing.code, 66);
  EXPECT_TRUE(Contains(missing.err, "run.json: the file cannot be read")) << missing.err;
  Diagnose({});
  Write("out/ekf/innovations.csv", "t_s,sensor\n0,stereo\n");
  const Outcome changed = Call({"diagnose", "out"});
  EXPECT_EQ(changed.code, 65);
  EXPECT_TRUE(Contains(changed.err, "the column 'landmark' is missing")) << changed.err;
}

}  // namespace
}  // namespace alidade
