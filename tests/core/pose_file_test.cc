// SPDX-License-Identifier: Apache-2.0
#include "core/src/pose_file.h"

#include <gtest/gtest.h>

#include <limits>

#include "alidade/trajectory.h"
#include "support/recording.h"

namespace alidade {
namespace {

using internal::FindPose;
using internal::PoseFile;
using internal::RunFolder;

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
}

TEST(PoseFile, IsReadBackAsItWasWritten) {
  const testing::TemporaryFolder folder;
  const double position[] = {0.1, -2.0, 3e-7}, orientation[] = {0.8, 0.6, 0.0, 0.0};
  Eigen::Matrix3d p, r;
  p << 6, 2, 3, 2, 8, 5, 3, 5, 9;
  r = 0.1 * p;
  const Eigen::Matrix3d known = p;
  {
    RunFolder run(folder / "run", false);
    PoseFile poses(run, "ekf/trajectory.tum");
    poses.Add(-33'000'000, position, orientation);
    poses.Close();
    PoseFile with(run, "ekf/trajectory_covariance.tum", true);
    with.Add(1'000'000'001, position, orientation, p, r);
    p(1, 1) = std::numeric_limits<double>::quiet_NaN();
    with.Add(2'000'000'000, position, orientation, p, r);
    with.Close();
    PoseFile truth(run, "truth.tum");
    const std::vector<double> at(position, position + 3), turned(orientation, orientation + 4);
    truth.AddTruth({5, {}, {turned, at}}, {1, 0});
    truth.AddTruth({6, {}, {turned, {}}}, {1, 0});
    truth.AddTruth({7, {}, {turned}}, {1, 0});
    truth.Close();
    run.Commit();
  }
  EXPECT_EQ(testing::Read(folder / "run/ekf/trajectory.tum"),
            "# t x y z qx qy qz qw\n-0.033000000 0.1 -2 3e-07 0.6 0 0 0.8\n");
  EXPECT_EQ(testing::Read(folder / "run/truth.tum"),
            "# t x y z qx qy qz qw\n0.000000005 0.1 -2 3e-07 0.6 0 0 0.8\n");
  const Trajectory t = ReadTrajectory(folder / "run/ekf/trajectory_covariance.tum");
  EXPECT_EQ(t.stamps, (std::vector<Stamp>{1'000'000'001, 2'000'000'000}));
  EXPECT_TRUE(t.orientations[0].isApprox(Eigen::Quaterniond(0.8, 0.6, 0.0, 0.0)));
  EXPECT_EQ(t.position_covariances[0], known);
  EXPECT_EQ(t.orientation_covariances[0], r);
  EXPECT_TRUE(t.position_covariances[1].isZero(0.0));
  EXPECT_EQ(t.orientation_covariances[1], r);
}

}  // namespace
}  // namespace alidade
