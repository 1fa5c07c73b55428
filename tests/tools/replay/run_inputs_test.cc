// SPDX-License-Identifier: Apache-2.0
#include "alidade/replay/run_inputs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "alidade/replay/build_ids.h"
#include "support/recording.h"
#include "support/temporary_folder.h"

namespace alidade::internal {
namespace {

namespace fs = std::filesystem;

std::string Written(const fs::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
  return file.string();
}

std::string InputsOf(const std::string& data, const std::vector<fs::path>& plugins = {},
                     const std::vector<std::string>& arguments = {"run"}) {
  const std::string path = data.empty() ? "" : ", path: '" + data + '\'';
  const Config config = Config::FromText("source: {type: tables" + path + "}\n", "a.yaml");
  return InputsJson({arguments, {"a.b=1"}, {"/somewhere"}, {}}, config, {config},
                    HashFiles(plugins));
}

std::vector<std::string> Differences(const std::string& before, const std::string& now) {
  return InputDifferences(before, "out/inputs.json", now);
}

TEST(RunInputs, AreReadAsTheyWereWritten) {
  const RecordedInputs inputs =
      ReadInputs(InputsOf("", {}, {"run", "--covariances"}), "out/inputs.json");
  EXPECT_EQ(inputs.command.arguments, (std::vector<std::string>{"run", "--covariances"}));
  EXPECT_EQ(inputs.command.settings, std::vector<std::string>{"a.b=1"});
  EXPECT_EQ(inputs.command.plugin_paths, std::vector<fs::path>{"/somewhere"});
  EXPECT_EQ(inputs.config, "a.yaml");
  EXPECT_EQ(inputs.read_once, "");
  EXPECT_EQ(ReadInputs(InputsOf("-"), "").read_once, "-");
  EXPECT_EQ(ReadInputs(InputsOf("/dev/null"), "").read_once, "/dev/null");
}

TEST(RunInputs, NameWhatDiffers) {
  const testing::TemporaryFolder folder;
  const std::string data = Written(folder / "a.csv", "1\n");
  const std::string plugin = Written(folder / "own.so", "one");
  const std::string before = InputsOf(data, {plugin});
  EXPECT_EQ(Differences(before, InputsOf(data, {plugin})), std::vector<std::string>{});
  Written(folder / "own.so", "two");
  // The expected numbers are the SHA-256 hashes of the texts `two` and `one`.
  EXPECT_EQ(Differences(before, InputsOf(data, {plugin})),
            (std::vector<std::string>{"plugin own.so: now 3fc4ccfe7458..., was 7692c3ad3540..."}));
  EXPECT_EQ(Differences(before, InputsOf(data)),
            (std::vector<std::string>{"plugin own.so: this input is missing now"}));
  Written(folder / "own.so", "one");
  Written(folder / "a.csv", "2\n");
  const auto other = Differences(before, InputsOf(data, {plugin}));
  ASSERT_EQ(other.size(), 1u);
  EXPECT_TRUE(other[0].starts_with("data " + data + ": now ")) << other[0];
  Written(folder / "a.csv", "1\n");
  EXPECT_EQ(Differences(before, InputsOf(data, {plugin}, {"run", "--covariances"})),
            (std::vector<std::string>{"command: now 'run --covariances', was 'run'"}));
}

TEST(RunInputs, AFolderOfDataStandsForItsFiles) {
  const testing::TemporaryFolder folder;
  const fs::path data = folder / "data";
  fs::create_directories(data / "deeper");
  Written(data / "a.csv", "1\n");
  const std::string before = InputsOf(data.string());
  Written(data / "deeper/b.csv", "1\n");
  EXPECT_EQ(Differences(before, InputsOf(data.string())), std::vector<std::string>{});
  Written(data / "truth.tum", "1\n");
  EXPECT_EQ(
      Differences(before, InputsOf(data.string())),
      (std::vector<std::string>{"data " + (data / "truth.tum").string() + ": this input is new"}));
}

TEST(RunInputs, HaveTheDataOfAllRunsOnce) {
  const testing::TemporaryFolder folder;
  std::vector<Config> runs;
  for (const char* name : {"b.csv", "a.csv", "b.csv"}) {
    const std::string data = Written(folder / name, "1\n");
    runs.push_back(Config::FromText("source: {type: tables, path: '" + data + "'}\n", "a.yaml"));
  }
  const std::string text = InputsJson({{"sweep"}, {}, {}}, runs[0], runs, {});
  const std::size_t first = text.find("/b.csv\""), second = text.find("/a.csv\"");
  EXPECT_LT(first, second);
  EXPECT_NE(second, text.npos);
  EXPECT_EQ(text.find("/b.csv\"", first + 1), text.npos) << text;
}

// A file that cannot be read has no hash, so it cannot be compared.
TEST(RunInputs, AFileThatCannotBeReadIsAnError) {
  const testing::TemporaryFolder folder;
  std::string text;
  EXPECT_EQ(testing::CodeOf([&] { HashFiles({folder / "none.so"}); }, &text), 74);
  EXPECT_EQ(text, (folder / "none.so").string() + ": the file cannot be read to compute its hash");
}

TEST(FindUsedPlugins, AreThoseOfModelsAndTypesAtAnyDepth) {
  const auto names = [](const std::string& yaml) {
    std::vector<std::string> files;
    const Config config = Config::FromText(yaml, "a.yaml");
    for (const fs::path& file : FindUsedPlugins({config, config}, testing::Host()))
      files.push_back(file.filename().string());
    std::ranges::sort(files);
    return files;
  };
  EXPECT_EQ(names("alidade: 1\n"), std::vector<std::string>{});
  const std::vector<std::string> expected = {"alidade_constant.so", "alidade_scale_2d.so",
                                             "alidade_tables.so"};
  EXPECT_EQ(names("state: {a: {model: constant}}\n"
                  "source: {type: tables, overrides: {sensors: {s: {model: scale_2d}}}}\n"
                  "estimators: {e: {type: ekf}}\n"),
            expected);
  EXPECT_EQ(names("estimators: {e: {overrides: {state: {a: {model: constant}}}}}\n"),
            std::vector<std::string>{"alidade_constant.so"});
  EXPECT_EQ(names("a: {model: csv, type: constant}\n"), std::vector<std::string>{});
}

TEST(RunInputs, WhatIsNoRecordIsRefused) {
  for (const char* text : {"[]", "{}", "{\"arguments\": 1}"}) {
    try {
      ReadInputs(text, "out/inputs.json");
      ADD_FAILURE() << text;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ExitCode::kBadData);
      EXPECT_TRUE(std::string(error.what()).starts_with("out/inputs.json: this is not ")) << text;
    }
  }
}

TEST(BuildIds, NameTheProgramAndTheLibrariesThatCompute) {
  const auto ids = BuildIds();
  for (const char* name : {"program", "processor", "kernels"}) {
    ASSERT_TRUE(ids.contains(name));
    EXPECT_NE(ids.at(name), "") << name;
  }
  const std::string& program = ids.at("program");
  EXPECT_GE(program.size(), 32u);
  EXPECT_EQ(program.find_first_not_of("0123456789abcdef"), std::string::npos) << program;
  const auto has = [&](const char* start) {
    return std::ranges::any_of(ids, [&](const auto& one) { return one.first.starts_with(start); });
  };
  EXPECT_TRUE(has("libalidade-core.so"));
  EXPECT_TRUE(has("libalidade-tools.so"));
}

}  // namespace
}  // namespace alidade::internal
