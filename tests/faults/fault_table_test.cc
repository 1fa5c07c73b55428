// SPDX-License-Identifier: Apache-2.0
//
// Checks that all tests that tests/faults/README.md lists exist.
#include <gtest/gtest.h>

#include <regex>
#include <set>

#include "support/program.h"

namespace alidade::testing {
namespace {

const fs::path kTests = fs::path(ALIDADE_SOURCE_DIR) / "tests";

/// Returns the name `Suite.Name` of every test in the sources, and `ConfigFault.NN_*` for the
/// number of every config fault.
std::set<std::string> TestsInSources() {
  std::set<std::string> tests;
  const std::regex test(R"(\nTEST(?:_F|_P)?\((\w+),\s+(\w+)\))"), config(R"re("(\d\d_))re");
  for (const auto& entry : fs::recursive_directory_iterator(kTests)) {
    if (!entry.path().string().ends_with("_test.cc")) continue;
    const std::string text = ReadText(entry.path());
    for (std::sregex_iterator match(text.begin(), text.end(), test), end; match != end; ++match) {
      tests.insert((*match)[1].str() + '.' + (*match)[2].str());
    }
    for (std::sregex_iterator match(text.begin(), text.end(), config), end; match != end; ++match) {
      tests.insert("ConfigFault." + (*match)[1].str() + '*');
    }
  }
  return tests;
}

TEST(FaultTable, NamesTestsThatExist) {
  const std::set<std::string> tests = TestsInSources();
  std::istringstream lines(ReadText(kTests / "faults/README.md"));
  const std::regex row(R"(\| \d+ \| [^|]+ \| ([^|]+) \|)"), name(R"([\w.*]+)");
  int rows = 0;
  std::smatch match;
  for (std::string line; std::getline(lines, line);) {
    if (!std::regex_match(line, match, row)) continue;
    ++rows;
    const std::string names = match[1];
    for (std::sregex_iterator next(names.begin(), names.end(), name), end; next != end; ++next) {
      EXPECT_TRUE(tests.contains(next->str())) << next->str();
    }
  }
  EXPECT_GT(rows, 80);
}

}  // namespace
}  // namespace alidade::testing
