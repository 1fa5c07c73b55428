// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/finished_run.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "support/recording.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

/// Writes `text` to `file`.
void Write(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file) << text;
}

TEST(FinishedRun, FindsItsColumnsByColumnsJson) {
  const TemporaryFolder folder;
  Record(OptionsFor(folder / "out"));
  const internal::ComparedRun before = internal::ReadRun(folder / "out");

  // Inserts a column of an unknown quantity after the time, before all other columns.
  const std::filesystem::path estimates = folder / "out/ekf/estimates.csv";
  std::string text;
  for (const std::string& line : Lines(estimates)) {
    const std::size_t comma = line.find(',');
    text += line.substr(0, comma) + (text.empty() ? ",note" : ",17") + line.substr(comma) + '\n';
  }
  Write(estimates, text);
  nlohmann::ordered_json columns = nlohmann::ordered_json::parse(Read(folder / "out/columns.json"));
  auto& list = columns.at("ekf/estimates.csv");
  list.insert(list.begin() + 1, {{"name", "note"}, {"quantity", "note"}});
  Write(folder / "out/columns.json", columns.dump());

  const internal::ComparedRun after = internal::ReadRun(folder / "out");
  ASSERT_EQ(after.estimators.size(), before.estimators.size());
  for (std::size_t i = 0; i < after.estimators.size(); ++i) {
    EXPECT_EQ(after.estimators[i].series.values, before.estimators[i].series.values);
    EXPECT_EQ(after.estimators[i].series.covariances, before.estimators[i].series.covariances);
  }
}

TEST(FinishedRun, WithoutAColumnOfABlockNamesTheBlock) {
  const TemporaryFolder folder;
  Record(OptionsFor(folder / "out"));
  nlohmann::ordered_json columns = nlohmann::ordered_json::parse(Read(folder / "out/columns.json"));
  columns.at("ekf/estimates.csv").erase(1);
  Write(folder / "out/columns.json", columns.dump());
  try {
    static_cast<void>(internal::ReadRun(folder / "out"));
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("columns.json"), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find("block 'target.depth'"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace alidade
