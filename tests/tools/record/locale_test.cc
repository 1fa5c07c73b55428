// SPDX-License-Identifier: Apache-2.0
//
// Tests fault 98 of tests/faults/README.md: a locale that writes numbers with a comma has no
// effect.
#include <cstdio>

#include "alidade/replay/replay.h"
#include "alidade/sweep/sweep.h"
#include "support/comma_locale.h"
#include "support/recording.h"

namespace alidade::testing {
namespace {

constexpr const char* kConfig = R"(alidade: 1
state:
  target: {model: constant_velocity, blocks: {position: depth, velocity: depth_rate},
           noise: {kind: discrete, acceleration: 1.25},
           initial: {depth: {mean: 0.3, sigma: 0.1}, depth_rate: {mean: 0, sigma: 0.5}}}
sensors:
  stereo: {model: stereo_disparity, stream: disparity, roles: {depth: target.depth},
           focal_px: 400.5, baseline_m: 0.065, sigma_px: 1.0}
source: {type: depth_target, seed: 1}
estimators: {ekf: {type: ekf, gate: 0.999}}
)";

void RecordAll(const fs::path& folder) {
  Record(OptionsFor(folder / "run"));
  const Config config = Config::FromText(kConfig, "locale.yaml");
  SweepFolder sweep(folder / "sweep", false);
  SweepOptions options;
  options.runs = 2;
  const SweepResult result = Sweep(config, Host(), options);
  sweep.Write(result, Summarise(result), config);
}

TEST(CommaLocale, ChangesNoByteOfWhatIsWritten) {
  const TemporaryFolder folder;
  RecordAll(folder / "plain");
  {
    const CommaLocale comma;
    if (!comma.active()) GTEST_SKIP() << "localedef is not available";
    char text[16];
    std::snprintf(text, sizeof text, "%.1f", 0.5);
    ASSERT_STREQ(text, "0,5");
    RecordAll(folder / "comma");
  }
  const std::vector<std::string> files = FilesIn(folder / "plain");
  EXPECT_GT(files.size(), 20u);
  EXPECT_EQ(files, FilesIn(folder / "comma"));
  for (const std::string& file : files) {
    if (internal::HasWallClock(fs::path(file).lexically_relative("run").string())) continue;
    EXPECT_EQ(Read(folder / "plain" / file), Read(folder / "comma" / file)) << file;
  }
  EXPECT_EQ(Read(folder / "comma/run/timing.json").find("\"wall_s\": 0,"), std::string::npos);
}

/// Runs kConfig with a filter that cannot step over the first gap. Returns the reason of the
/// failure.
std::string ReasonOfAFailure() {
  std::string text = kConfig;
  const std::string entry = "gate: 0.999";
  text.replace(text.find(entry), entry.size(), "max_dt_s: 1.5e-9, on_divergence: fail");
  Experiment experiment = BuildExperiment(Config::FromText(text, "locale.yaml"), Host());
  return Run(experiment, {}).reason;
}

TEST(CommaLocale, ChangesNoMessage) {
  const std::string plain = ReasonOfAFailure();
  EXPECT_NE(plain.find(" s needs more than 1e+06 steps of 1.5e-09 s; increase max_dt_s; last "
                       "good state at 0.000000 s: target.depth = 0."),
            std::string::npos)
      << plain;
  const CommaLocale comma;
  if (!comma.active()) GTEST_SKIP() << "localedef is not available";
  EXPECT_EQ(ReasonOfAFailure(), plain);
}

}  // namespace
}  // namespace alidade::testing
