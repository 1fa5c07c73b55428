// SPDX-License-Identifier: Apache-2.0
//
// Tests `alidade replay`, which repeats the run of a run folder and reports each difference.
#include "support/run_files.h"

namespace alidade::testing {
namespace {

class ReplayCli : public ProgramTest {
 protected:
  void Make(Arguments command) const {
    command.insert(command.end(), {"-o", "out", "--quiet"});
    ASSERT_EQ(Call(command).code, 0) << Read("stderr");
  }
  void ExpectEqual(const Arguments& more = {}) const {
    Arguments command = {"replay", "out"};
    command.insert(command.end(), more.begin(), more.end());
    const Outcome replay = Call(command);
    EXPECT_EQ(replay.code, 0) << replay.out << replay.err;
    EXPECT_TRUE(replay.out.starts_with("out: all ")) << replay.out;
    EXPECT_TRUE(Contains(replay.out, " files are equal")) << replay.out;
  }
  std::string ExpectDifferent() const {
    const Outcome replay = Call({"replay", "out"});
    EXPECT_EQ(replay.code, 1) << replay.out << replay.err;
    return replay.out;
  }
  void WriteTable(const std::string& last) const {
    std::string table = "t_s,d\n";
    for (int i = 0; i < 40; ++i) table += std::to_string(0.03 * i) + ",80\n";
    Write("table.csv", table + "1.23," + last + '\n');
  }
};

TEST_F(ReplayCli, MakesARunAgain) {
  Make({"run", "config.yaml", "--seed", "7", "--set", "estimators.ekf.gate=0.99"});
  const Outcome replay = Call({"replay", "out"});
  EXPECT_EQ(replay.code, 0) << replay.out << replay.err;
  const auto files = RunFiles(folder_ / "out").size();
  EXPECT_EQ(replay.out, "out: all " + std::to_string(files) +
                            " files are equal; not compared: timing.csv, timing.json\n");
  ExpectEqual({"-o", "again"});
  ExpectSameFiles(folder_ / "again", folder_ / "out");
}

TEST_F(ReplayCli, MakesExamplesAgain) {
  for (const Arguments& command : std::vector<Arguments>{
           {"examples/07_depth_pairs/config.yaml", "--covariances"},
           {"examples/10_slam_scene/config.yaml", "--set", "source.max_frames=20"},
           {"examples/22_range_bearing/config.yaml"}}) {
    SCOPED_TRACE(command[0]);
    Arguments run = command;
    run[0] = ALIDADE_SOURCE_DIR "/" + command[0];
    run.insert(run.begin(), "run");
    run.emplace_back("--force");
    Make(run);
    ExpectEqual();
  }
}

TEST_F(ReplayCli, MakesASweepAgain) {
  Make({"sweep", "config.yaml", "--runs", "6", "--shard", "2/2", "--vary",
        "sensors.stereo.sigma_px=0.5,1"});
  ExpectEqual();
}

// A replay does not depend on the file name of the config.
TEST_F(ReplayCli, MakesARunOfAConfigOfAnyNameAgain) {
  for (const char* name : {"again", "config", "made"}) {
    Write(name, Read("config.yaml"));
    Make({"run", name, "--force"});
    ExpectEqual();
  }
}

// The plugin folder named by the environment variable also contains a plugin that is refused. This
// refusal is not an error in the run or in the replay.
TEST_F(ReplayCli, MakesARunWithThePluginsOfTheEnvironmentAgain) {
  fs::create_directory(folder_ / "own");
  fs::permissions(folder_ / "own", fs::perms::owner_all);
  fs::copy_file(ALIDADE_BINARY_DIR "/tests/faults/ratio.so", folder_ / "own/ratio.so");
  Write("own/broken.so", "no plugin");
  ::setenv("ALIDADE_PLUGIN_PATH", (folder_ / "own").c_str(), 1);
  Make({"run", "config.yaml", "--set",
        "sensors.ratio={model: ratio, stream: inverse_scale, roles: {numerator: target.depth, "
        "denominator: template.inverse_distance}}"});
  ::unsetenv("ALIDADE_PLUGIN_PATH");
  EXPECT_TRUE(Contains(Read("out/inputs.json"), "\"file\": \"ratio.so\""));
  ExpectEqual();
}

// If a run fails because of its data, the replay fails in the same way.
TEST_F(ReplayCli, MakesAFailureAgain) {
  WriteTable("none");
  ASSERT_EQ(Call({"run", "table.yaml", "-o", "out"}).code, 65);
  ExpectEqual();
}

TEST_F(ReplayCli, NamesDataThatChanged) {
  WriteTable("80");
  Make({"run", "table.yaml"});
  WriteTable("79");
  const std::string out = ExpectDifferent();
  EXPECT_TRUE(Contains(out, "input differs: data " + (folder_ / "table.csv").string() + ": now "))
      << out;
  EXPECT_TRUE(Contains(out, "differs: out/measurements.csv:42:24: now '79', was '80'\n")) << out;
  EXPECT_FALSE(Contains(out, "differs: out/config.resolved.yaml")) << out;
}

TEST_F(ReplayCli, NamesAPluginThatChanged) {
  fs::create_directory(folder_ / "own");
  fs::permissions(folder_ / "own", fs::perms::owner_all);
  fs::copy_file(ALIDADE_BINARY_DIR "/tests/faults/ratio.so", folder_ / "own/ratio.so");
  Make({"run", "config.yaml", "--plugin-path", "own", "--set",
        "sensors.ratio={model: ratio, stream: inverse_scale, roles: {numerator: target.depth, "
        "denominator: template.inverse_distance}}"});
  ExpectEqual();
  std::ofstream(folder_ / "own/ratio.so", std::ios::app | std::ios::binary) << "another build";
  const std::string out = ExpectDifferent();
  EXPECT_TRUE(out.starts_with("input differs: plugin ratio.so: now ")) << out;
  EXPECT_TRUE(Contains(out, "differs: out/run.json:")) << out;
  EXPECT_FALSE(Contains(out, "estimates.csv")) << out;
  fs::remove_all(folder_ / "own");
  const Outcome gone = Call({"replay", "out"});
  EXPECT_EQ(gone.code, 69);
  EXPECT_TRUE(Contains(gone.err, "'ratio'")) << gone.err;
}

TEST_F(ReplayCli, NamesAConfigThatChanged) {
  Make({"run", "config.yaml"});
  std::string config = Read("out/config.resolved.yaml");
  config.replace(config.find("0.999"), 5, "0.9");
  Write("out/config.resolved.yaml", config);
  EXPECT_TRUE(ExpectDifferent().starts_with("input differs: config: now "));
}

TEST_F(ReplayCli, NamesARowThatChanged) {
  Make({"run", "config.yaml"});
  std::string rows = Read("out/ekf/estimates.csv");
  const std::size_t second = rows.find('\n') + 1;
  rows.replace(second, 3, "7.7");
  Write("out/ekf/estimates.csv", rows);
  Write("out/truth.csv", Read("out/truth.csv") + "9,9,9,9\n");
  fs::remove(folder_ / "out/expected.csv");
  const std::string out = ExpectDifferent();
  EXPECT_TRUE(Contains(out, "differs: out/ekf/estimates.csv:2:1: now '0.0")) << out;
  EXPECT_TRUE(Contains(out, "', was '7.7")) << out;
  EXPECT_TRUE(Contains(out, "differs: out/truth.csv:154:1: the file now ends before this row\n"))
      << out;
  EXPECT_TRUE(Contains(out, "differs: out/expected.csv: the recorded file has been removed\n"))
      << out;
  EXPECT_TRUE(Contains(out, "\nout: 3 of ")) << out;
  const Outcome replay = Call({"replay", "out", "--json"});
  EXPECT_EQ(replay.code, 1);
  Write("replay.json", replay.out);
  const Config json = Json("replay.json");
  EXPECT_FALSE(json.root().At("equal").Flag());
  EXPECT_EQ(json.root().At("differences").Items().size(), 3u);
  EXPECT_EQ(json.root().At("differences").Items()[0].At("file").Text(), "ekf/estimates.csv");
  EXPECT_EQ(json.root().At("differences").Items()[0].At("line").Number(), 2);
}

TEST_F(ReplayCli, RefusesWhatCannotBeMadeAgain) {
  const Outcome none = Call({"replay", "out"});
  EXPECT_EQ(none.code, 66);
  EXPECT_TRUE(none.err.starts_with("error: out/inputs.json: the file cannot be read: "))
      << none.err;
  WriteTable("80");
  before_ = "exec < table.csv";
  Make({"run", "table.yaml", "--set", "source.path=-"});
  before_.clear();
  const Outcome piped = Call({"replay", "out"});
  EXPECT_EQ(piped.code, 66);
  EXPECT_TRUE(Contains(piped.err, "the data came from '-', which can be read only once"))
      << piped.err;
  Make({"run", "config.yaml", "--force"});
  std::string record = Read("out/run.json");
  record.replace(record.find("\"ok\""), 4, "\"stopped\"");
  Write("out/run.json", record);
  const Outcome stopped = Call({"replay", "out"});
  EXPECT_EQ(stopped.code, 65);
  EXPECT_TRUE(Contains(stopped.err, "error: out: the run or sweep was stopped")) << stopped.err;
  record.replace(record.find("\"stopped\""), 9, "\"running\"");
  Write("out/run.json", record);
  const Outcome unfinished = Call({"replay", "out"});
  EXPECT_EQ(unfinished.code, 65);
  EXPECT_TRUE(Contains(unfinished.err, "error: out: the run or sweep is not finished; expected "))
      << unfinished.err;
  Write("out/inputs.json", "[1, 2]");
  EXPECT_EQ(Call({"replay", "out"}).code, 65);
}

}  // namespace
}  // namespace alidade::testing
