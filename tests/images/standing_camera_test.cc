// SPDX-License-Identifier: Apache-2.0
//
// Runs the example 45 on the recorded images of both cameras of a vehicle that stands still.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "alidade/config/config.h"
#include "support/program.h"

namespace alidade {
namespace {

using testing::Outcome;

class StandingCamera : public testing::ProgramTest, public ::testing::WithParamInterface<int> {
 protected:
  const std::string example_ = std::string(ALIDADE_SOURCE_DIR) + "/examples/45_standing_images/";

  void SetUp() override {
    ProgramTest::SetUp();
    const char* const data = std::getenv("ALIDADE_DATA");
    const std::filesystem::path folder(data == nullptr ? "" : data);
    const auto camera = folder / "euroc-static-stereo" / ("cam" + std::to_string(GetParam()));
    const auto poses = folder / "imu-euroc-v101" / "V1_01_easy_gt.csv";
    if (data == nullptr || !std::filesystem::exists(camera) || !std::filesystem::exists(poses)) {
      GTEST_SKIP() << "ALIDADE_DATA does not contain euroc-static-stereo and imu-euroc-v101";
    }
    const std::string command = "'" + example_ + "arrange.sh' '" + camera.string() + "' '" +
                                poses.string() + "' '" + (folder_ / "standing").string() + "'";
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
    const Outcome run = Call({"run", example_ + "config.yaml", "--set",
                              "source.path=" + (folder_ / "standing/data").string(), "-o", "run"});
    ASSERT_EQ(run.code, 0) << run.err;
  }

  /// Returns the cells of a column of a file of the run.
  std::vector<double> Column(const std::string& file, const std::string& name) const {
    std::istringstream lines(Read("run/" + file));
    std::string line, cell;
    std::getline(lines, line);
    std::istringstream header(line);
    int index = 0;
    while (std::getline(header, cell, ',') && cell != name) ++index;
    EXPECT_EQ(cell, name) << file;
    std::vector<double> column;
    while (std::getline(lines, line)) {
      std::istringstream cells(line);
      for (int i = 0; i <= index; ++i) std::getline(cells, cell, ',');
      column.push_back(std::strtod(cell.c_str(), nullptr));
    }
    return column;
  }
  double MedianOf(const std::string& file, const std::string& name) const {
    std::vector<double> column = Column(file, name);
    EXPECT_GE(column.size(), 60u) << file;
    const auto middle = column.begin() + std::ssize(column) / 2;
    std::ranges::nth_element(column, middle);
    return *middle;
  }
  double Metric(const std::string& name) const {
    const Config run = Json("run/run.json");
    return run.root().At("estimators").At("ekf").At("metrics").At(name).Number();
  }
};

TEST_P(StandingCamera, DoesNotDrift) {
  EXPECT_LE(Metric("rmse:cam.position"), 1.15e-3);
  EXPECT_LE(Metric("rmse:cam.orientation"), 1.05 * 0.176 * M_PI / 180.0);
  for (const char* axis : {"x", "y", "z"}) {
    const std::string name = std::string("cam.position.") + axis;
    for (const double position : Column("ekf/estimates.csv", name)) {
      EXPECT_LE(std::abs(position), 3.35e-3) << name;
    }
  }
  EXPECT_LE(Metric("nees.mean:cam"), Metric("nees.high:cam"));
}

// A camera that stands still does not measure distances, and its own position is as uncertain at
// the end as at the second image.
TEST_P(StandingCamera, KeepsItsUncertainty) {
  const double prior = 0.15;
  EXPECT_GE(MedianOf("ekf/landmarks.csv", "sigma_inverse_distance"), 0.75 * prior);
  EXPECT_LE(MedianOf("overconfident/landmarks.csv", "sigma_inverse_distance"), 0.45 * prior);
  for (const char* axis : {"x", "y", "z"}) {
    const std::string name = std::string("sigma:cam.position.") + axis;
    const std::vector<double> sigma = Column("ekf/estimates.csv", name);
    ASSERT_EQ(sigma.size(), 5u);
    EXPECT_GE(sigma.back(), 0.99 * sigma[1]) << name;
    EXPECT_LE(sigma.back(), 1.2 * sigma[1]) << name;
  }
  EXPECT_TRUE(testing::Contains(Read("run/ekf/events.csv"), "determines scale"));
}

INSTANTIATE_TEST_SUITE_P(Cameras, StandingCamera, ::testing::Values(0, 1));

}  // namespace
}  // namespace alidade
