// SPDX-License-Identifier: Apache-2.0
//
// Every file of tests/faults/run is a config with one fault; its first lines say what must come of
// it: the exit code, the line named in the message (0: none), and words of the message.
#include <gtest/gtest.h>

#include <algorithm>

#include "support/program.h"

namespace alidade::testing {
namespace {

const fs::path kFolder = fs::path(ALIDADE_SOURCE_DIR) / "tests/faults/run";

std::vector<std::string> ConfigsWithAFault() {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(kFolder)) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem());
  }
  std::sort(names.begin(), names.end());
  return names;
}

/// What stands after `key` in the first lines of the file.
std::string Expected(const std::string& text, const std::string& key) {
  const std::size_t at = text.find("# " + key + ": ");
  EXPECT_NE(at, std::string::npos) << key;
  const std::size_t start = at + key.size() + 4;
  return text.substr(start, text.find('\n', start) - start);
}

class ConfigFault : public ProgramTest, public ::testing::WithParamInterface<std::string> {};

TEST_P(ConfigFault, GetsItsCodePlaceAndWords) {
  const fs::path file = kFolder / (GetParam() + ".yaml");
  const std::string text = ReadText(file);
  const std::string plugins = ALIDADE_BINARY_DIR "/tests/faults";
  const Outcome outcome = Call({"run", file.string(), "-o", "out", "--plugin-path", plugins});
  EXPECT_EQ("exit " + std::to_string(outcome.code), Expected(text, "fault")) << outcome.err;
  EXPECT_EQ(outcome.err.rfind("error: ", 0), 0u) << outcome.err;
  const std::string line = Expected(text, "line");
  const std::string place = file.string() + ":" + (line == "0" ? "" : line + ":");
  EXPECT_NE(outcome.err.find(place), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find(Expected(text, "text")), std::string::npos) << outcome.err;
  EXPECT_TRUE(outcome.out.empty());
  EXPECT_FALSE(Exists("hacked"));
}

INSTANTIATE_TEST_SUITE_P(Files, ConfigFault, ::testing::ValuesIn(ConfigsWithAFault()),
                         [](const auto& file) { return "_" + file.param; });

class ConfigText : public ProgramTest {
 protected:
  Outcome RunText(const std::string& text) const {
    Write("text.yaml", text);
    return Call({"run", "text.yaml", "-o", "out", "--no-figures", "--force"});
  }
};

// FAULTS 15
TEST_F(ConfigText, LargerThanOneMebibyteIsRefused) {
  constexpr std::size_t kLimit = 1 << 20;
  const std::string padded = kDepthConfig + '#' + std::string(kLimit, 'x');
  EXPECT_EQ(RunText(padded.substr(0, kLimit)).code, 0);
  const Outcome large = RunText(padded.substr(0, kLimit + 1));
  EXPECT_EQ(large.code, 78);
  EXPECT_EQ(large.err, "error: text.yaml: larger than 1 MiB; expected a config of at most 1 MiB\n");
}

// FAULTS 18
TEST_F(ConfigText, ByteOrderMarkAndCarriageReturnsMakeNoDifference) {
  ASSERT_EQ(RunText(kDepthConfig).code, 0);
  const std::string estimates = Read("out/ekf/estimates.csv");
  std::string text = "\xEF\xBB\xBF";
  for (const char c : kDepthConfig) text += c == '\n' ? "\r\n" : std::string(1, c);
  const Outcome outcome = RunText(text);
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(Read("out/ekf/estimates.csv"), estimates);
}

// FAULTS 22
TEST_F(ConfigText, AFolderAndAMissingFileAreInputMissing) {
  const auto expect = [&](const std::string& config, const std::string& reason) {
    const Outcome outcome = Call({"run", config, "-o", "out"});
    EXPECT_EQ(outcome.code, 66);
    EXPECT_EQ(outcome.err, "error: " + config + ": cannot be read: " + reason + '\n');
  };
  fs::create_directory(folder_ / "folder.yaml");
  fs::create_symlink("nothing", folder_ / "link.yaml");
  expect("folder.yaml", "it is a directory");
  expect("missing.yaml", "No such file or directory");
  expect("link.yaml", "No such file or directory");
}

}  // namespace
}  // namespace alidade::testing
