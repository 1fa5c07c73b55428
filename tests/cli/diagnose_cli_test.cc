// SPDX-License-Identifier: Apache-2.0
#include "support/program.h"
#include "support/terminal.h"

namespace alidade {
namespace {

using testing::Arguments;
using testing::Contains;
using testing::Outcome;

class DiagnoseCli : public testing::ProgramTest {
 protected:
  /// Runs config.yaml with settings, and returns the outcome of `diagnose`.
  Outcome Diagnose(const Arguments& settings, const Arguments& options = {}) const {
    Arguments run = {"run", "config.yaml", "-o", "out", "--force", "--quiet"};
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

/// Returns a copy of a row of a CSV file in which the cell of column `name` is `value`.
std::string WithCell(const std::string& header, std::string row, std::string_view name,
                     const std::string& value) {
  const auto index = std::count(header.begin(), header.begin() + header.find(name), ',');
  std::size_t begin = 0;
  for (auto i = index; i > 0; --i) begin = row.find(',', begin) + 1;
  return row.replace(begin, row.find(',', begin) - begin, value);
}

TEST_F(DiagnoseCli, IgnoresTheNumbersOfMeasurementsThatNoUpdateUsed) {
  const Outcome before = Diagnose({});
  const std::string text = Read("out/ekf/innovations.csv");
  const std::size_t first = text.find('\n') + 1;
  const std::string header = text.substr(0, first),
                    row = text.substr(first, text.find('\n', first) + 1 - first);
  const std::string not_pd =
                        WithCell(header, WithCell(header, row, "s0", "nan"), "outcome", "not_pd"),
                    too_large =
                        WithCell(header, WithCell(header, row, "nis", "inf"), "outcome", "gated");
  Write("out/ekf/innovations.csv", header + not_pd + too_large + text.substr(first));
  const Outcome after = Call({"diagnose", "out"});
  EXPECT_EQ(after.code, 0) << after.err;
  EXPECT_EQ(after.out, before.out);
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

/// Settings that simulate a target with the models of the filter, and a stereo sensor with twice
/// the noise that the filter assumes. A gate would reject the largest innovations, and shorten the
/// step.
const Arguments kNoisyStereo = {
    "source={type: models, duration_s: 5, overrides: {sensors: {stereo: {sigma_px: 2}}}}",
    "state.target.initial.depth={mean: 5, sigma: 0.02}",
    "state.target.initial.depth_rate={mean: 0.3, sigma: 0.1}",
    "state.template.initial.inverse_distance={mean: 0.2, sigma: 0.002}",
    "sensors.stereo.focal_px=2000",
    "estimators.ekf.gate=none"};

TEST_F(DiagnoseCli, WhyNamesTheWrongSigmaAndASettingThatRemovesTheAlarm) {
  const Outcome outcome = Diagnose(kNoisyStereo, {"--why"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  const std::size_t start = outcome.out.find("parameters of ekf:\n  sensors.stereo.sigma_px is 1");
  ASSERT_NE(start, std::string::npos) << outcome.out;
  const std::string option = "--set 'estimators.ekf.overrides.sensors.stereo.sigma_px=";
  const std::size_t setting = outcome.out.find(option, start);
  ASSERT_NE(setting, std::string::npos) << outcome.out;
  const double sigma = std::stod(outcome.out.substr(setting + option.size()));
  EXPECT_NEAR(sigma, 2.0, 0.4);
  Arguments corrected = kNoisyStereo;
  corrected.push_back("estimators.ekf.overrides.sensors.stereo.sigma_px=" + std::to_string(sigma));
  EXPECT_TRUE(
      Contains(Diagnose(corrected, {"--why"}).out,
               "no other value of a parameter explains the innovations significantly better"))
      << Read("stdout");
}

// The gate rejects the largest innovations of the assumed sigma, so one step is too short.
TEST_F(DiagnoseCli, WhyRepeatsTheStepIfAGateRejectsTheLargestInnovations) {
  Arguments gated = kNoisyStereo;
  gated.back() = "estimators.ekf.gate=0.999";
  const Outcome outcome = Diagnose(gated, {"--why", "--json"});
  const Config json = Config::FromText(outcome.out, "stdout");
  const auto tested = json.root().At("estimators").At("ekf").At("parameters").At("tested").Items();
  ASSERT_FALSE(tested.empty()) << outcome.err;
  EXPECT_EQ(tested[0].At("key").Text(), "sensors.stereo.sigma_px");
  EXPECT_EQ(tested[0].At("value").Number(), 1.0);
  EXPECT_NEAR(tested[0].At("estimate").Number(), 2.0, 0.25);
}

TEST_F(DiagnoseCli, WhyShowsTheRunsOfTheFilterOnATerminal) {
  ASSERT_EQ(Diagnose(kNoisyStereo).code, 0);
  const testing::Terminal terminal;
  before_ = "TERM=xterm; export TERM; exec 2>" + terminal.name();
  ASSERT_EQ(Call({"diagnose", "out", "--why"}).code, 0);
  // One run reads the data, one has the numbers of the config, and two test each of five numbers.
  // The first number is an alarm, whose estimate then needs four runs for each step.
  const std::string shown = terminal.Text();
  EXPECT_TRUE(Contains(shown, "\r1 of 12 runs of the filter, 8 %")) << shown;
  ASSERT_EQ(Call({"diagnose", "out", "--why", "--json"}).code, 0);
  EXPECT_EQ(terminal.Text(), "");
}

TEST_F(DiagnoseCli, WhyListsEveryParameterInJson) {
  const Outcome outcome = Diagnose(kNoisyStereo, {"--why", "--json"});
  const Config json = Config::FromText(outcome.out, "stdout");
  const Node parameters = json.root().At("estimators").At("ekf").At("parameters");
  const std::vector<Node> tested = parameters.At("tested").Items();
  ASSERT_EQ(tested.size(), 5u) << outcome.out;
  EXPECT_EQ(tested[0].At("key").Text(), "sensors.stereo.sigma_px");
  EXPECT_TRUE(tested[0].At("alarm").Flag());
  EXPECT_GT(tested[0].At("z").Number(), 4.5);
  EXPECT_EQ(tested[0].At("value").Number(), 1.0);
  EXPECT_NEAR(tested[0].At("estimate").Number(), 2.0, 0.4);
  EXPECT_EQ(parameters.At("not_tested").Items().size(), 0u);
}

TEST_F(DiagnoseCli, WhySaysThatASmootherIsNotTested) {
  const Outcome outcome = Diagnose({"estimators.smoother={type: rts}"}, {"--why"});
  EXPECT_TRUE(Contains(outcome.out,
                       "parameters of smoother:\n  not tested: an estimator of type 'rts' has no "
                       "innovations of predictions; only recursive filters are tested\n"))
      << outcome.out;
}

TEST_F(DiagnoseCli, WhySaysThatRobustSensorsAreNotTested) {
  const Outcome outcome = Diagnose(
      {"sensors.stereo.loss={huber: 1.345}", "sensors.scale.loss={huber: 1.345}"}, {"--why"});
  EXPECT_TRUE(Contains(outcome.out,
                       "parameters of ekf:\n  not tested: all of its sensors have a "
                       "robust `loss`"))
      << outcome.out;
}

TEST_F(DiagnoseCli, WhyExplainsAParameterThatCannotBeTested) {
  const Outcome outcome = Diagnose({"state.target.noise.acceleration=0"}, {"--why", "--json"});
  const Config json = Config::FromText(outcome.out, "stdout");
  const auto not_tested = json.root().At("estimators").At("ekf").At("parameters").At("not_tested");
  ASSERT_EQ(not_tested.Items().size(), 1u) << outcome.out;
  EXPECT_EQ(not_tested.Items()[0].At("key").Text(), "state.target.noise.acceleration");
  EXPECT_EQ(not_tested.Items()[0].At("because").Text(), "the standard deviation is 0");
}

TEST_F(DiagnoseCli, OneEstimatorCanBeSelected) {
  const Outcome one =
      Diagnose({"estimators.two={type: ekf, sensors: [stereo]}"}, {"--estimator", "two"});
  EXPECT_EQ(one.out, "diagnosis of two:\n  nothing found\n");
  const Outcome unknown = Call({"diagnose", "out", "--estimator", "tow"});
  EXPECT_EQ(unknown.code, 2);
  EXPECT_TRUE(Contains(unknown.err,
                       "--estimator: the run has no estimator 'tow'; expected ekf, two; did you "
                       "mean 'two'?"))
      << unknown.err;
}

TEST_F(DiagnoseCli, WhyNeedsTheInputsAndTheDataOfTheRun) {
  Write("table.csv", "t_s,d\n0,86\n0.1,87\n0.2,86.5\n");
  ASSERT_EQ(Call({"run", "table.yaml", "-o", "out", "--quiet"}).code, 0) << Read("stderr");
  EXPECT_EQ(Call({"diagnose", "out", "--why"}).code, 0) << Read("stderr");
  Write("table.csv", "t_s,d\n0,86\n0.1,87\n0.2,84\n");
  const Outcome changed = Call({"diagnose", "out", "--why"});
  EXPECT_EQ(changed.code, 65);
  EXPECT_TRUE(Contains(changed.err, "inputs.json: the data have changed since the run: data "))
      << changed.err;
  std::filesystem::remove(folder_ / "table.csv");
  const Outcome missing = Call({"diagnose", "out", "--why"});
  EXPECT_EQ(missing.code, 65);
  EXPECT_TRUE(Contains(missing.err, "table.csv: this input is missing now")) << missing.err;
  std::filesystem::remove(folder_ / "out/inputs.json");
  const Outcome no_inputs = Call({"diagnose", "out", "--why"});
  EXPECT_EQ(no_inputs.code, 66);
  EXPECT_TRUE(Contains(no_inputs.err, "inputs.json: the file cannot be read")) << no_inputs.err;
  EXPECT_EQ(Call({"diagnose", "out"}).code, 0) << "without --why, the inputs are not necessary";
}

}  // namespace
}  // namespace alidade
