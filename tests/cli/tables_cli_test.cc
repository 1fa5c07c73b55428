// SPDX-License-Identifier: Apache-2.0
//
// Tests that the source tables reads the files that the program writes.
#include "support/program.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;
using testing::Outcome;

class TablesCli : public testing::ProgramTest {
 protected:
  /// Runs `config` with the given source, and returns the estimates.
  std::string Estimates(const std::string& config, const std::string& folder,
                        const std::string& source = "") {
    testing::Arguments arguments = {"run", config, "-o", folder};
    if (!source.empty()) arguments.insert(arguments.end(), {"--set", "source=" + source});
    const Outcome run = Call(arguments);
    EXPECT_EQ(run.code, 0) << run.err;
    return Read(folder + "/ekf/estimates.csv");
  }
};

TEST_F(TablesCli, ReadsTheStreamsAndTheTruthOfASimulation) {
  const std::string direct = Estimates("config.yaml", "direct");
  ASSERT_EQ(Call({"simulate", "config.yaml", "-o", "data"}).code, 0);
  EXPECT_EQ(Estimates("config.yaml", "tables",
                      "{type: tables, path: data, files: ["
                      "{path: disparity.csv, streams: {disparity: disparity}}, "
                      "{path: inverse_scale.csv, streams: {inverse_scale: inverse_scale}}, "
                      "{path: truth.csv, truth: {depth: depth, depth_rate: depth_rate, "
                      "inverse_distance: inverse_distance}}]}"),
            direct);
  EXPECT_EQ(Read("tables/ekf/errors.csv"), Read("direct/ekf/errors.csv"));
}

TEST_F(TablesCli, ReadsTheMeasurementsOfARun) {
  const std::string direct = Estimates("config.yaml", "direct");
  EXPECT_EQ(Estimates("config.yaml", "tables",
                      "{type: tables, path: direct/measurements.csv, time: {repeats: true}, "
                      "streams: {disparity: {columns: v0, rows: {stream: disparity}}, "
                      "inverse_scale: {columns: v0, rows: {stream: inverse_scale}}}}"),
            direct);
}

TEST_F(TablesCli, ReadsLandmarksWithTheirIds) {
  fs::copy_file(ALIDADE_SOURCE_DIR "/examples/22_range_bearing/config.yaml",
                folder_ / "laser.yaml");
  const std::string direct = Estimates("laser.yaml", "direct");
  ASSERT_EQ(Call({"simulate", "laser.yaml", "-o", "data"}).code, 0);
  // The laser sees no post in the last frames, so neither file contains these frames.
  const std::string simulated = Estimates(
      "laser.yaml", "simulated",
      "{type: tables, path: data/posts.csv, time: {repeats: true}, streams: {posts: {columns: "
      "[posts.0, posts.1, posts.2, posts.3], landmark: landmark}}}");
  EXPECT_GT(simulated.size(), direct.size() / 2);
  EXPECT_TRUE(direct.starts_with(simulated));
  const std::string measured =
      Estimates("laser.yaml", "measured",
                "{type: tables, path: direct/measurements.csv, time: {repeats: true}, streams: "
                "{posts: {columns: [v0, v1, v2, v3], landmark: landmark}}}");
  EXPECT_GT(measured.size(), direct.size() / 2);
  EXPECT_TRUE(direct.starts_with(measured));
}

// Ranges in the plane to known points, with the variance of each range, and positions with a full
// covariance.
TEST_F(TablesCli, ReadsKnownNumbersAndCovariances) {
  std::string rows = "t_s,r,x,y,s,px,py,pxx,pxy,pyy\n";
  for (int k = 0; k < 20; ++k) {
    const std::string noise = std::to_string(0.1 + 0.01 * k);
    rows += std::to_string(0.1 * k) + ',' + std::to_string(5.0 + 0.1 * k) + ",3,4," + noise +
            ",0.1,0.2," + noise + ",0.02," + noise + '\n';
  }
  Write("log.csv", rows);
  Write("robot.yaml",
        "alidade: 1\n"
        "state: {robot: {model: constant_velocity, dimensions: 2, noise: {acceleration: 1}, "
        "initial: {position: {sigma: 1}, velocity: {sigma: 1}}}}\n"
        "sensors:\n"
        "  beacon: {model: range, stream: range, roles: robot, sigma_m: 9}\n"
        "  gps: {model: position, stream: gps, roles: robot, sigma_m: 9}\n"
        "source: {type: tables, path: log.csv, streams: {range: {columns: r, known: [x, y], sigma: "
        "s}, gps: {columns: [px, py], covariance: [pxx, pxy, pyy]}}}\n"
        "estimators: [ekf]\n");
  const std::string direct = Estimates("robot.yaml", "direct");
  EXPECT_EQ(Estimates("robot.yaml", "measured",
                      "{type: tables, path: direct/measurements.csv, time: {repeats: true}, "
                      "streams: {range: {columns: v0, rows: {stream: range}, known: [known0, "
                      "known1], variance: R0}, gps: {columns: [v0, v1], rows: {stream: gps}, "
                      "covariance: [R0, R1, R2, R3]}}}"),
            direct);
  ASSERT_EQ(Call({"simulate", "robot.yaml", "-o", "data"}).code, 0);
  EXPECT_EQ(Estimates("robot.yaml", "simulated",
                      "{type: tables, path: data, files: [{path: range.csv, streams: {range: "
                      "{columns: range, known: [known0, known1], variance: R0}}}, {path: gps.csv, "
                      "streams: {gps: {columns: [gps.0, gps.1], covariance: [R0, R1, R2, R3]}}}]}"),
            direct);
}

TEST_F(TablesCli, OutputsDoNotReplaceTheFilesOfTheSource) {
  Write("log.csv", "t_s,d\n0,80\n");
  const std::string before = Read("log.csv");
  Write("files.yaml", testing::kTargetConfig + testing::kStereoConfig +
                          "source: {type: tables, files: [{path: log.csv, streams: {disparity: "
                          "d}}]}\nestimators: {ekf: {type: ekf}}\n");
  const Outcome run = Call({"run", "files.yaml", "-o", "log.csv", "--force"});
  EXPECT_NE(run.code, 0);
  EXPECT_EQ(Read("log.csv"), before);
  ASSERT_EQ(Call({"run", "files.yaml", "-o", "out"}).code, 0);
  EXPECT_NE(Read("out/inputs.json").find("/log.csv\", \"bytes\": 11"), std::string::npos)
      << Read("out/inputs.json");
}

// The paths of files are relative to the config, and `source.path` replaces their folder.
TEST_F(TablesCli, ThePathOfTheSourceReplacesTheFolderOfItsFiles) {
  Write("log.csv", "t_s,d\n0,80\n");
  fs::create_directory(folder_ / "parts");
  fs::create_directory(folder_ / "other");
  Write("other/log.csv", "t_s,d\n0,80\n1,81\n");
  Write("parts/log.csv", "t_s,d\n0,80\n1,81\n2,82\n");
  Write("parts/source.yaml",
        "source: {type: tables, files: [{path: log.csv, streams: {disparity: d}}]}\n");
  Write("files.yaml", "include: parts/source.yaml\n" + testing::kTargetConfig +
                          testing::kStereoConfig + "estimators: {ekf: {type: ekf}}\n");
  const auto frames = [&](const testing::Arguments& settings) {
    testing::Arguments arguments = {"run", "files.yaml", "-o", "out", "--force"};
    arguments.insert(arguments.end(), settings.begin(), settings.end());
    const Outcome run = Call(arguments);
    EXPECT_EQ(run.code, 0) << run.err;
    return Json("out/run.json").root().At("frames").Number();
  };
  EXPECT_EQ(frames({}), 3);
  EXPECT_EQ(frames({"--set", "source.path=other"}), 2);
}

}  // namespace
}  // namespace alidade
