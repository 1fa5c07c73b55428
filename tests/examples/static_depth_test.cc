// SPDX-License-Identifier: Apache-2.0
//
// Compares examples/09_static_depth with the engine on the same numbers.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <memory>

#include "alidade/estimation/ekf.h"
#include "alidade/experiment/read_problem.h"
#include "alidade/experiment/run.h"
#include "alidade/experiment/short_forms.h"
#include "examples/09_static_depth/measurements.h"

namespace alidade {
namespace {

using static_depth::kRows;
using static_depth::kStep;

Config Example05() {
  return Config::FromFile(ALIDADE_SOURCE_DIR "/examples/05_depth_principled/config.yaml");
}

TEST(StaticDepth, ItsNumbersAreThoseOfExample05) {
  const Config config = Example05();
  const PluginHost host;
  const std::unique_ptr<Source> source = std::move(BuildExperiment(config, host).source);
  SourceFrame frame;
  for (const static_depth::Row& row : kRows) {
    ASSERT_TRUE(source->Next(frame));
    double disparity = 0.0, inverse_scale = 0.0;
    for (const Measurement& m : frame.measurements) {
      const std::string& stream = source->streams()[static_cast<std::size_t>(m.stream)].name;
      if (stream == "disparity") disparity = m.values[0];
      if (stream == "inverse_scale") inverse_scale = m.values[0];
    }
    EXPECT_NEAR(row.disparity_px, disparity, 0.00501);
    EXPECT_NEAR(row.inverse_scale, inverse_scale, 0.0000501);
  }
}

TEST(StaticDepth, PrintsWhatTheEngineEstimates) {
  Config config = Example05();
  const PluginHost host;
  ExpandShortForms(config, host);
  const Problem problem = ReadProblem(config.root(), host, {});
  EkfOptions options;
  options.gate = 0.9999;
  options.fuse = Fuse::kPerMeasurement;
  Ekf engine(problem, options, {{"disparity", 1}, {"inverse_scale", 1}});
  std::FILE* printed = ::popen(ALIDADE_BINARY_DIR "/bin/example_static_depth", "r");
  ASSERT_NE(printed, nullptr);
  char line[128];
  ASSERT_NE(std::fgets(line, sizeof(line), printed), nullptr);  // skips the column names
  int used = 0, k = 0;
  for (const static_depth::Row& row : kRows) {
    Frame frame;
    frame.timestamp = TimestampFromSeconds(kStep * k);
    frame.measurements = {{frame.timestamp, 1, -1, {row.inverse_scale}, {}}};
    if (row.disparity_px > 0.0) {
      frame.measurements.push_back({frame.timestamp, 0, -1, {row.disparity_px}, {}});
    }
    for (const MeasurementReport& m : engine.Process(frame).measurements()) {
      used += m.outcome == Outcome::kAccepted ? 1 : 0;
    }
    if (k++ % 5 != 0) continue;
    double t = 0.0, depth = 0.0, sigma = 0.0;
    ASSERT_NE(std::fgets(line, sizeof(line), printed), nullptr);
    ASSERT_EQ(std::sscanf(line, "%lf %lf %lf", &t, &depth, &sigma), 3) << line;
    constexpr double kPrinted = 5.01e-7;  // half a unit of the sixth decimal, the last printed one
    EXPECT_NEAR(t, Seconds(frame.timestamp), 5e-4);
    EXPECT_NEAR(depth, engine.state().values()[0], kPrinted);
    EXPECT_NEAR(sigma, std::sqrt(engine.state().covariance().Variance(0)), kPrinted);
  }
  int rows = 0, accepted = 0;
  double rmse_mm = 0.0;
  ASSERT_NE(std::fgets(line, sizeof(line), printed), nullptr);
  ASSERT_EQ(
      std::sscanf(line, "%d rows, %d measurements used, rmse %lf", &rows, &accepted, &rmse_mm), 3);
  EXPECT_EQ(rows, k);
  EXPECT_EQ(accepted, used);
  EXPECT_LT(rmse_mm, 2.5);  // example 05 has an RMSE of 2.05 mm over the whole series
  EXPECT_EQ(::pclose(printed), 0);
}

}  // namespace
}  // namespace alidade
