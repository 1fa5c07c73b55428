// SPDX-License-Identifier: Apache-2.0
//
// Runs plugins that were built with plugin ABI 1.0 in the current program. If a change of the
// engine is meant to change estimates, ALIDADE_REPLAY_WRITE=1 rewrites 1.0/estimates.csv.
#include <cmath>
#include <cstdlib>
#include <map>
#include <sstream>

#include "alidade/check/check.h"
#include "alidade/check/plugin_listing.h"
#include "alidade/experiment/run.h"
#include "alidade/io/sha256.h"
#include "alidade/plugin/plugin_sections.h"
#include "golden_fixture.h"
#include "support/recording.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

using GoldenRun = GoldenTest;

TEST_P(GoldenRun, IsTheFileThatWasKept) {
  std::istringstream sums(testing::Read(Kept() / "SHA256SUMS"));
  std::map<std::string, std::string> kept;
  for (std::string sum, name; sums >> sum >> name;) kept[name] = sum;
  const std::string name = std::string(GetParam()) + ".so";
  EXPECT_EQ(internal::Sha256OfFile(Kept() / name), kept[name])
      << "never rebuild a plugin of this folder; only add new ones";
  EXPECT_EQ(ReadBuildTag(Lent()).abi_minor, 0);
}

TEST_P(GoldenRun, IsDescribed) {
  const std::string line = PluginInfo(Host(), "golden_line");
  for (const char* words :
       {"role position: vector(1), m", "role offset: vector(1), m", "(model parameter state)",
        "measurement length", "known with each measurement anchor", "can initialise position",
        "side", "text", "noise_model", "constant | relative", "max_m", "gain"}) {
    EXPECT_NE(line.find(words), std::string::npos) << "'" << words << "' is not in\n" << line;
  }
  const std::string fix = PluginInfo(Host(), "golden_fix");
  EXPECT_NE(fix.find("measurement fix: product(vector(2), angle) of antenna, compass"),
            std::string::npos)
      << fix;
  const std::string cart = PluginInfo(Host(), "golden_cart");
  EXPECT_NE(cart.find("noise: discrete"), std::string::npos) << cart;
  EXPECT_NE(cart.find("input odometry: vector(2)"), std::string::npos) << cart;
}

TEST_P(GoldenRun, KeepsTheRules) {
  const std::map<std::string, std::string> models = {
      {"golden_line", "{gain: 1.5, height_m: 2.5, sigma_m: 0.1, side: left, max_m: 20}"},
      {"golden_fix", "{antenna_m: [1, 2], sigma_m: [0.1, 0.2], sigma_rad: 0.1, coupled: true}"},
      {"golden_direction", "{field: [1, -2, 3], sigma_rad: 0.1}"},
      {"golden_cart", "{noise: {speed: 0.1, turn_rate: 0.2}}"}};
  for (const auto& [name, parameters] : models) {
    const std::vector<PluginEntry> entries = FindModels(Host(), Lent(), name);
    ASSERT_EQ(entries.size(), 1u) << name;
    const Config config = Parse(parameters);
    const auto findings = CheckModel(entries.front(), config.root(), {});
    EXPECT_FALSE(AnyFailure(findings)) << CheckText(entries.front(), findings);
  }
}

TEST_P(GoldenRun, GivesTheEstimatesOfItsDay) {
  const Config config = Config::FromFile(Kept() / "config.yaml");
  Experiment experiment = BuildExperiment(config, Host());
  const fs::path folder = folder_ / "run";
  Recorder recorder(testing::OptionsFor(folder), config);
  const RunResult result = testing::RunInto(recorder, experiment);
  recorder.Finish(result);
  ASSERT_EQ(result.status, RunStatus::kOk) << result.reason;
  const fs::path file = folder / "ekf/estimates.csv", kept = Kept() / "estimates.csv";
  if (std::getenv("ALIDADE_REPLAY_WRITE") != nullptr) {
    fs::copy_file(file, kept, fs::copy_options::overwrite_existing);
  }
  const auto now = testing::Lines(file), then = testing::Lines(kept);
  ASSERT_EQ(now.size(), then.size());
  EXPECT_EQ(now[0], then[0]);
  for (std::size_t row = 1; row < then.size(); ++row) {
    const auto a = testing::Cells(now[row]), b = testing::Cells(then[row]);
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
      // Other mathematical libraries round differently, and a filter propagates the difference.
      EXPECT_NEAR(std::stod(a[i]), std::stod(b[i]), 1e-7) << now[row];
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Abi10, GoldenRun, ::testing::ValuesIn(kGolden),
                         [](const auto& one) { return std::string(one.param); });

}  // namespace
}  // namespace alidade
