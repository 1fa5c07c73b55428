// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/finished_run.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "support/recording.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

/// Writes `text` to `file`.
void Write(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file) << text;
}

/// Replaces the first `old_text` after `start` in a file.
void Replace(const std::filesystem::path& file, const std::string& start,
             const std::string& old_text, const std::string& new_text) {
  std::string text = Read(file);
  const std::size_t place = text.find(old_text, text.find(start));
  ASSERT_NE(place, text.npos);
  Write(file, text.replace(place, old_text.size(), new_text));
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
  const std::string first_block = "{\n      \"name\": \"target.depth\"";
  Replace(folder / "out/columns.json", "ekf/estimates.csv", first_block,
          "{\"name\": \"note\", \"quantity\": \"note\"}, " + first_block);

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
  Replace(folder / "out/columns.json", "ekf/estimates.csv", "\"quantity\": \"value\"",
          "\"quantity\": \"other\"");
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
