// SPDX-License-Identifier: Apache-2.0
//
// Tests examples/15_slam_representations: the same filter with different landmark representations.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>

#include "alidade/sweep/sweep.h"

namespace alidade {
namespace {

/// Returns the summaries of the seeds 1001 to 1004, keyed by estimator.
std::map<std::string, SweepSummary> Four() {
  const Config config = Config::FromFile(std::filesystem::path(ALIDADE_SOURCE_DIR) /
                                         "examples/15_slam_representations/config.yaml");
  const PluginHost host(PluginPaths(config));
  SweepOptions options;
  options.runs = 4;
  options.first_seed = 1001;
  std::map<std::string, SweepSummary> by_name;
  for (SweepSummary& one : Summarise(Sweep(config, host, options))) {
    EXPECT_EQ(one.used, 4) << one.name;
    EXPECT_EQ(one.diverged + one.CountOf(VerdictState::kLost), 0) << one.name;
    by_name[one.name] = one;
  }
  return by_name;
}

TEST(SlamRepresentations, AgreeAndConversionIsHarmlessOnlyWhereItIsLinear) {
  const auto forms = Four();
  const auto mean = [&](const char* form, const char* key) {
    return forms.at(form).metrics.at(key).mean;
  };
  for (const char* key : {"rmse:cam.position", "rmse:cam.orientation", "nees.mean:cam"}) {
    const double six = mean("inverse_depth", key);
    EXPECT_NEAR(mean("anchored", key), six, 0.02 * six) << key;
    EXPECT_NEAR(mean("xyz_10", key), six, 0.03 * six) << key;
  }
  EXPECT_LE(mean("inverse_depth", "nees.mean:cam"), 1.4);
  EXPECT_GE(mean("inverse_depth", "nees.within95:cam"), 0.85);
  // Conversion at a linearity index [Civera2008] of 40 % makes the filter overconfident. At 60 %
  // the NEES is even larger.
  EXPECT_GE(mean("xyz_40", "nees.mean:cam"), 1.6);
  EXPECT_LE(mean("xyz_40", "nees.within95:cam"), 0.75);
  EXPECT_GT(mean("xyz_60", "nees.mean:cam"), mean("xyz_40", "nees.mean:cam"));
  EXPECT_LT(mean("xyz_60", "nees.within95:cam"), mean("xyz_40", "nees.within95:cam"));
}

}  // namespace
}  // namespace alidade
