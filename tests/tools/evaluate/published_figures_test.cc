// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "alidade/evaluate/evaluate.h"

namespace alidade {
namespace {

/// Compares with results of other programs on public trajectories. The test is skipped if
/// ALIDADE_DATA does not contain the trajectories.
class PublicFigures : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* data = std::getenv("ALIDADE_DATA");
    if (data != nullptr) folder_ = std::filesystem::path(data) / "trajectories";
    if (!std::filesystem::is_directory(folder_)) {
      GTEST_SKIP() << "ALIDADE_DATA does not contain trajectories";
    }
  }
  Evaluation Compare(const std::string& reference, const std::string& estimate,
                     Alignment alignment) const {
    EvaluateOptions options;
    options.alignment = alignment;
    return Evaluate(ReadTrajectory(folder_ / reference), ReadTrajectory(folder_ / estimate),
                    options);
  }

  std::filesystem::path folder_;
};

/// Returns `value` with six decimals, as in the published results.
std::string Printed(double value) {
  char text[64];
  std::snprintf(text, sizeof text, "%.6f", value);
  return text;
}

/// Expects the number n, the scale and the RMSE (m) of the positions.
void ExpectFigures(const Evaluation& evaluation, std::size_t n, const std::string& scale,
                   const std::string& rmse) {
  EXPECT_EQ(evaluation.absolute[0].errors.size(), n);
  EXPECT_EQ(Printed(evaluation.alignment.scale), scale);
  EXPECT_EQ(Printed(evaluation.absolute[0].statistics.rmse), rmse);
}

TEST_F(PublicFigures, DeskOfTumIsAsPublishedToTheLastDigit) {
  const char* truth = "fr2_desk_groundtruth.txt";
  const char* orb = "fr2_desk_ORB.txt";
  ExpectFigures(Compare(truth, orb, Alignment::kNone), 2174, "1.000000", "3.173994");
  ExpectFigures(Compare(truth, orb, Alignment::kSe3), 2174, "1.000000", "0.008119");
  const Evaluation sim3 = Compare(truth, orb, Alignment::kSim3);
  ExpectFigures(sim3, 2174, "0.996970", "0.006123");
  EXPECT_EQ(sim3.absolute[1].relation, PoseRelation::kAngleDeg);
  EXPECT_EQ(Printed(sim3.absolute[1].statistics.rmse), "0.989036");
  EXPECT_EQ(sim3.relative[0].errors.size(), 2173u);
  EXPECT_EQ(Printed(sim3.relative[0].statistics.rmse), "0.003485");
}

TEST_F(PublicFigures, MonocularDeskIsAsPublishedToTheLastDigit) {
  const char* truth = "fr2_desk_groundtruth.txt";
  const char* mono = "fr2_desk_ORB_kf_mono.txt";
  const Evaluation se3 = Compare(truth, mono, Alignment::kSe3);
  ExpectFigures(se3, 118, "1.000000", "0.939049");
  ASSERT_EQ(se3.warnings.size(), 1u);
  EXPECT_NE(
      se3.warnings[0].find("the scale is 2.228 (the error is 0.007729 m with sim3 and 0.939 m with "
                           "se3): the estimate probably has no metric scale"),
      std::string::npos)
      << se3.warnings[0];
  const Evaluation sim3 = Compare(truth, mono, Alignment::kSim3);
  ExpectFigures(sim3, 118, "2.228022", "0.007729");
  EXPECT_TRUE(sim3.warnings.empty()) << sim3.warnings[0];
}

TEST_F(PublicFigures, DrivesOfKittiAreAsPublishedToTheLastDigit) {
  struct Row {
    const char* estimate;
    Alignment alignment;
    const char *scale, *rmse;
  };
  const char* orb = "KITTI_00_ORB.txt";
  const char* sptam = "KITTI_00_SPTAM.txt";
  for (const Row& row : {Row{orb, Alignment::kNone, "1.000000", "7.790289"},
                         {orb, Alignment::kSe3, "1.000000", "1.303450"},
                         {orb, Alignment::kSim3, "1.004698", "0.937709"},
                         {sptam, Alignment::kNone, "1.000000", "9.224542"},
                         {sptam, Alignment::kSe3, "1.000000", "3.738488"},
                         {sptam, Alignment::kSim3, "1.004527", "3.635294"}}) {
    SCOPED_TRACE(std::string(row.estimate) + ' ' + ToString(row.alignment));
    const Evaluation evaluation = Compare("KITTI_00_gt.txt", row.estimate, row.alignment);
    ExpectFigures(evaluation, 4541, row.scale, row.rmse);
    EXPECT_TRUE(evaluation.by_row);
    EXPECT_TRUE(evaluation.warnings.empty()) << evaluation.warnings[0];
  }
}

}  // namespace
}  // namespace alidade
