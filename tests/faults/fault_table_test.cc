// SPDX-License-Identifier: Apache-2.0
//
// tests/faults/README.md names a test for each fault: it is there, and says the number itself.
#include <gtest/gtest.h>

#include <map>
#include <regex>

#include "support/program.h"

namespace alidade::testing {
namespace {

const fs::path kTests = fs::path(ALIDADE_SOURCE_DIR) / "tests";

/// Tests by the number of their fault.
std::map<int, std::vector<std::string>> Table() {
  std::map<int, std::vector<std::string>> table;
  std::istringstream lines(ReadText(kTests / "faults/README.md"));
  const std::regex row(R"(\| (\d+) \| [^|]+ \| ([^|]+) \|)"), name(R"([A-Za-z0-9_.]+)");
  std::smatch match;
  for (std::string line; std::getline(lines, line);) {
    if (!std::regex_match(line, match, row)) continue;
    const std::string names = match[2];
    for (std::sregex_iterator at(names.begin(), names.end(), name), end; at != end; ++at) {
      table[std::stoi(match[1])].push_back(at->str());
    }
  }
  return table;
}

/// `Suite.Name` of every test in the sources, and what stands before it in its file: its own
/// comment, or that of the file.
std::map<std::string, std::string> TestsInSources() {
  std::map<std::string, std::string> tests;
  const std::regex test(R"(\nTEST(?:_F|_P)?\((\w+),\s+(\w+)\))");
  for (const auto& entry : fs::recursive_directory_iterator(kTests)) {
    if (!entry.path().string().ends_with("_test.cc")) continue;
    const std::string text = ReadText(entry.path());
    for (std::sregex_iterator at(text.begin(), text.end(), test), end; at != end; ++at) {
      tests[(*at)[1].str() + '.' + (*at)[2].str()] = text;
    }
  }
  return tests;
}

TEST(FaultTable, NamesTestsThatAreThere) {
  const auto tests = TestsInSources();
  ASSERT_GT(tests.size(), 300u);
  for (const auto& [fault, names] : Table()) {
    for (const std::string& name : names) {
      const bool there =
          name.ends_with(".yaml") ? fs::exists(kTests / "faults/run" / name) : tests.contains(name);
      EXPECT_TRUE(there) << fault << ": " << name;
    }
  }
}

TEST(FaultTable, TheTestsSayTheNumbers) {
  const auto tests = TestsInSources();
  for (const auto& [fault, names] : Table()) {
    const std::string number = std::to_string(fault);
    // In a comment, as `// FAULTS 36, 37: ...`, `// 88`, `// ---- 56, 57: ...`, or as the number
    // of a config or of a faulty model.
    const std::regex named("\\.Fault" + number + "[A-Z]");  // as TracksTest.Fault27WrongColumns
    const std::regex said("//[ A-Z-]*(?:\\d+, )*" + number + "(?!\\d)|Fault\\{\\s*" + number + ",");
    bool any = false;
    for (const std::string& name : names) {
      const std::string prefix = (fault < 10 ? "0" : "") + number + '_';
      any = any || name.starts_with(prefix) || std::regex_search(name, named) ||
            (tests.contains(name) && std::regex_search(tests.at(name), said));
    }
    EXPECT_TRUE(any) << "no test of fault " << number << " says so";
  }
}

TEST(FaultTable, HasTheFaultsOfConfigsDataPluginsEstimationAndRuns) {
  const auto table = Table();
  for (int fault = 1; fault <= 100; ++fault) EXPECT_TRUE(table.contains(fault)) << fault;
}

}  // namespace
}  // namespace alidade::testing
