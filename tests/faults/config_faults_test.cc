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

}  // namespace
}  // namespace alidade::testing
