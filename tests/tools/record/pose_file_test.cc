// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/pose_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "alidade/evaluate/trajectory.h"
#include "support/recording.h"

namespace alidade {
namespace {

using internal::FindPose;
using internal::OutputFolder;
using internal::PoseFile;

TEST(FindPose, TakesTheFirstPositionWithItsOrientation) {
  const auto place = FindPose({{"a.orientation", 4},
                               {"b.position", 3},
                               {"c.position", 2},
                               {"c.orientation", 4},
                               {"d.orientation", 4},
                               {"d.position", 3},
                               {"a.position", 3}});
  ASSERT_TRUE(place);
  EXPECT_EQ(place->position, 5u);
  EXPECT_EQ(place->orientation, 4u);
  EXPECT_FALSE(FindPose({{"b.position", 3}, {"a.orientation", 4}}));
  EXPECT_FALSE(FindPose({{"b.position", 3}, {"b.orientation", 3}}));
  EXPECT_FALSE(place->planar);
}

TEST(FindPose, APlanarPoseIsAPositionOfTwoAndAnAngle) {
  for (const char* angle : {"orientation", "heading", "yaw", "angle", "theta"}) {
    const auto place = FindPose({{"a.position", 2},
                                 {"b.heading", 1},
                                 {"b.position", 3},
                                 {"c." + std::string(angle), 1},
                                 {"c.position", 2}});
    ASSERT_TRUE(place) << angle;
    EXPECT_TRUE(place->planar);
    EXPECT_EQ(place->position, 4u);
    EXPECT_EQ(place->orientation, 3u);
  }
  EXPECT_FALSE(FindPose({{"c.position", 2}, {"c.speed", 1}}));
  EXPECT_FALSE(FindPose({{"c.position", 2}, {"c.heading", 2}}));
  // Names without a state entry are possible, for example the names of truths.
  const auto bare = FindPose({{"heading", 1}, {"position", 2}});
  ASSERT_TRUE(bare);
  EXPECT_EQ(bare->position, 1u);
  EXPECT_EQ(bare->orientation, 0u);
  EXPECT_FALSE(FindPose({{"a.heading", 1}, {"position", 2}}));
}

TEST(PoseFile, APlanarPoseIsWrittenAsOneInSpace) {
  const testing::TemporaryFolder folder;
  // The heading is 90 degrees: qz = qw = sin 45 deg.
  const double position[] = {1.0, -2.0}, heading[] = {std::acos(0.0)};
  Eigen::MatrixXd p(2, 2), r(1, 1);
  p << 6, 2, 2, 8;
  r << 0.5;
  {
    OutputFolder run(folder / "run", false);
    PoseFile with(run, "with.tum", {0, 1, true}, true);
    with.Add(1'000'000'000, position, heading, p, r);
    with.Close();
    PoseFile truth(run, "truth.tum", {1, 0, true});
    truth.AddTruth({5, {}, {{heading[0]}, {1.0, -2.0}}});
    truth.Close();
    run.Commit();
  }
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(heading[0], Eigen::Vector3d::UnitZ()));
  const Trajectory t = ReadTrajectory(folder / "run/with.tum");
  EXPECT_EQ(t.positions.col(0), Eigen::Vector3d(1.0, -2.0, 0.0));
  EXPECT_TRUE(t.orientations[0].isApprox(turn, 1e-15)) << t.orientations[0].coeffs();
  Eigen::Matrix3d position_covariance = Eigen::Matrix3d::Zero();
  position_covariance.topLeftCorner<2, 2>() = p;
  EXPECT_EQ(t.position_covariances[0], position_covariance);
  EXPECT_EQ(t.orientation_covariances[0],
            Eigen::Matrix3d(Eigen::Vector3d(0.0, 0.0, 0.5).asDiagonal()));
  const Trajectory truth = ReadTrajectory(folder / "run/truth.tum");
  EXPECT_EQ(truth.positions.col(0), Eigen::Vector3d(1.0, -2.0, 0.0));
  EXPECT_TRUE(truth.orientations[0].isApprox(turn, 1e-15));
}

TEST(PoseFile, IsReadBackAsItWasWritten) {
  const testing::TemporaryFolder folder;
  const double position[] = {0.1, -2.0, 3e-7}, orientation[] = {0.8, 0.6, 0.0, 0.0};
  Eigen::Matrix3d p, r;
  p << 6, 2, 3, 2, 8, 5, 3, 5, 9;
  r = 0.1 * p;
  const Eigen::Matrix3d known = p;
  {
    OutputFolder run(folder / "run", false);
    PoseFile poses(run, "ekf/trajectory.tum", {0, 1});
    poses.Add(-33'000'000, position, orientation);
    poses.Close();
    PoseFile with(run, "ekf/trajectory_covariance.tum", {0, 1}, true);
    with.Add(1'000'000'001, position, orientation, p, r);
    p(1, 1) = std::numeric_limits<double>::quiet_NaN();
    with.Add(2'000'000'000, position, orientation, p, r);
    with.Close();
    PoseFile truth(run, "truth.tum", {1, 0});
    const std::vector<double> at(position, position + 3), turned(orientation, orientation + 4);
    truth.AddTruth({5, {}, {turned, at}});
    truth.AddTruth({6, {}, {turned, {}}});
    truth.AddTruth({7, {}, {turned}});
    truth.Close();
    run.Commit();
  }
  EXPECT_EQ(testing::Read(folder / "run/ekf/trajectory.tum"),
            "# t x y z qx qy qz qw\n-0.033000000 0.1 -2 3e-07 0.6 0 0 0.8\n");
  EXPECT_EQ(testing::Read(folder / "run/truth.tum"),
            "# t x y z qx qy qz qw\n0.000000005 0.1 -2 3e-07 0.6 0 0 0.8\n");
  const Trajectory t = ReadTrajectory(folder / "run/ekf/trajectory_covariance.tum");
  EXPECT_EQ(t.timestamps, (std::vector<Timestamp>{1'000'000'001, 2'000'000'000}));
  EXPECT_TRUE(t.orientations[0].isApprox(Eigen::Quaterniond(0.8, 0.6, 0.0, 0.0)));
  EXPECT_EQ(t.position_covariances[0], known);
  EXPECT_EQ(t.orientation_covariances[0], r);
  EXPECT_TRUE(t.position_covariances[1].isZero(0.0));
  EXPECT_EQ(t.orientation_covariances[1], r);
}

}  // namespace
}  // namespace alidade
