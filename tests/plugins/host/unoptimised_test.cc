// SPDX-License-Identifier: Apache-2.0
//
// Plugins that were built without optimisation, and what is said of them.
#include <set>

#include "alidade/compare/compare.h"
#include "alidade/inspect/check.h"
#include "alidade/inspect/plugin_listing.h"
#include "alidade/run/run.h"
#include "host_fixture.h"
#include "support/recording.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPlugin = "driven_unoptimised.so";

class UnoptimisedTest : public HostTest {
 protected:
  PluginHost host_{{Built("driven_unoptimised")}};
};

TEST_F(UnoptimisedTest, TheBuildTagKnows) {
  EXPECT_NE(ReadBuildTag(Built("driven_unoptimised")).flags & ALIDADE_BUILT_UNOPTIMISED, 0u);
  EXPECT_EQ(ReadBuildTag(Built("matrix_baseline")).flags & ALIDADE_BUILT_UNOPTIMISED, 0u);
  std::set<std::string> files;
  const PluginHost host({Built("driven_unoptimised"), Built("matrix_baseline")});
  for (const PluginEntry& entry : host.entries()) {
    const bool bare = entry.plugin.parent_path() == Built("matrix_baseline").parent_path();
    if (bare && entry.unoptimised) files.insert(entry.plugin.filename().string());
  }
  EXPECT_EQ(files, std::set<std::string>{kPlugin});
}

TEST_F(UnoptimisedTest, TheInformationOfItsModelsSaysSo) {
  const std::string words =
      "  built without optimisation: build it with -O2, in CMake with -DCMAKE_BUILD_TYPE=Release\n";
  EXPECT_NE(PluginInfo(host_, "driven").find(words), std::string::npos);
  EXPECT_NE(PluginInfoJson(host_, "driven").find("\"unoptimised\": true"), std::string::npos);
  const PluginHost optimised({Built("matrix_baseline")});
  const std::string name = FindModels(optimised, Built("matrix_baseline")).front().name;
  EXPECT_EQ(PluginInfo(optimised, name).find("optimisation"), std::string::npos);
}

TEST_F(UnoptimisedTest, ARunAndItsComparisonSaySoOfTheWallClock) {
  const Config config =
      Config::FromFile(fs::path(ALIDADE_SOURCE_DIR) / "tests/plugins/driven/config.yaml");
  const fs::path folder = folder_ / "run";
  Experiment experiment = BuildExperiment(config, host_);
  EXPECT_TRUE(experiment.unoptimised.contains(kPlugin));
  Recorder recorder({folder, false, false, "alidade run"}, config);
  const RunResult result = testing::RunInto(recorder, experiment);
  recorder.Finish(result);
  const std::string note = UnoptimisedText(result.unoptimised);
  EXPECT_TRUE(note.starts_with("wall clock: built without optimisation")) << note;
  EXPECT_NE(note.find(kPlugin), std::string::npos) << note;
  const Comparison comparison = CompareFolders({folder}, {});
  EXPECT_EQ(std::ranges::count(comparison.notes, note), 1);
}

TEST_F(UnoptimisedTest, NothingIsSaidWhereAllAreOptimised) { EXPECT_EQ(UnoptimisedText({}), ""); }

}  // namespace
}  // namespace alidade
