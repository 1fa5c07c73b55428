// SPDX-License-Identifier: Apache-2.0
#include "alidade/evaluate/trajectory.h"

#include <gtest/gtest.h>

#include <fstream>

#include "alidade/base/error.h"
#include "support/recording.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

class TrajectoryFiles : public ::testing::Test {
 protected:
  void Write(const fs::path& name, const std::string& text) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  /// Returns the trajectory read from a file with this text.
  Trajectory Read(const std::string& text, TrajectoryFormat format = TrajectoryFormat::kDetect,
                  NonFiniteRows non_finite = NonFiniteRows::kRefuse) const {
    Write("poses.txt", text);
    return ReadTrajectory(folder_ / "poses.txt", format, non_finite);
  }
  Trajectory ReadFinite(const std::string& text) const {
    return Read(text, TrajectoryFormat::kDetect, NonFiniteRows::kSkip);
  }
  /// Returns the error message of Read without the path of the folder, or "" if there is no error.
  std::string Refusal(const std::string& text,
                      TrajectoryFormat format = TrajectoryFormat::kDetect) const {
    try {
      Read(text, format);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ExitCode::kBadData);
      return std::string(error.what()).substr(folder_.path().string().size() + 1);
    }
    return {};
  }
  /// Returns the warnings for a file with this text, one warning per line, without the path of the
  /// folder.
  std::string WarningsOf(const std::string& text) const { return WarningsOf(Read(text)); }
  std::string WarningsOf(const Trajectory& trajectory) const {
    std::string all;
    for (const std::string& warning : trajectory.warnings) {
      all += warning.substr(folder_.path().string().size() + 1) + '\n';
    }
    return all;
  }

  testing::TemporaryFolder folder_;
};

using Eigen::Vector3d;

/// End of an error message about a file whose format was detected.
const std::string kReadAsTum = "; read as tum (8 columns); the alternative is --format euroc";

TEST_F(TrajectoryFiles, TumIsReadExactlyWhateverTheLineEnds) {
  const Trajectory t = Read(
      "\xEF\xBB\xBF# t x y z qx qy qz qw\r\n"
      "1311868163.869700001 -0.5 1e-1 +2 0 0 0 1\r\n"
      "\r\n"
      "# between\n"
      "1311868163.9\t1  2 3 0.6 0 0 0.8  \n"
      "1311868164 4 5 6 0 0 -1.0005 0");
  EXPECT_EQ(t.format, TrajectoryFormat::kTum);
  ASSERT_EQ(t.size(), 3);
  EXPECT_EQ(t.timestamps, (std::vector<Timestamp>{1311868163869700001, 1311868163900000000,
                                                  1311868164000000000}));
  EXPECT_EQ(t.positions.col(0), Vector3d(-0.5, 0.1, 2.0));
  EXPECT_EQ(t.positions.col(1), Vector3d(1, 2, 3));
  EXPECT_TRUE(t.orientations[1].isApprox(Eigen::Quaterniond(0.8, 0.6, 0, 0), 1e-15));
  EXPECT_DOUBLE_EQ(t.orientations[2].norm(), 1.0);
  EXPECT_EQ(t.first_line, 2);
  EXPECT_FALSE(t.has_covariances());
  EXPECT_TRUE(t.warnings.empty());
}

TEST_F(TrajectoryFiles, TwentyColumnsAreTumWithCovariancesRotationFirst) {
  const Trajectory t = Read("0 1 2 3 0 0 0 1 11 12 13 22 23 33 0.6 0.2 0.3 0.8 0.5 0.9\n");
  ASSERT_TRUE(t.has_covariances());
  Eigen::Matrix3d orientation, position;
  orientation << 11, 12, 13, 12, 22, 23, 13, 23, 33;
  position << 0.6, 0.2, 0.3, 0.2, 0.8, 0.5, 0.3, 0.5, 0.9;
  EXPECT_EQ(t.orientation_covariances[0], orientation);
  EXPECT_EQ(t.position_covariances[0], position);
}

TEST_F(TrajectoryFiles, KittiTakesItsTimestampsFromTheFileBeside) {
  // The first pose is rotated by 90 degrees about z.
  const std::string rows = "0 -1 0 7 1 0 0 8 0 0 1 9\n1 0 0 0 0 1 0 0 0 0 1 0\n";
  const Trajectory bare = Read(rows);
  EXPECT_EQ(bare.format, TrajectoryFormat::kKitti);
  EXPECT_FALSE(bare.has_timestamps());
  EXPECT_EQ(bare.positions.col(0), Vector3d(7, 8, 9));
  EXPECT_TRUE((bare.orientations[0] * Vector3d::UnitX()).isApprox(Vector3d::UnitY(), 1e-15));

  Write("times.txt", "0.000000e+00\n1.037359e-01\n");
  EXPECT_EQ(Read(rows).timestamps, (std::vector<Timestamp>{0, 103735900}));
  Write("poses_times.txt", "5\n6\n");
  EXPECT_EQ(Read(rows).timestamps, (std::vector<Timestamp>{5'000'000'000, 6'000'000'000}));
  Write("poses_times.txt", "5\n");
  EXPECT_NE(Refusal(rows).find("times.txt:1: the number of times is 1, "), std::string::npos);
  EXPECT_NE(Refusal(rows).find("; expected one time for each pose"), std::string::npos);
  // times.txt can belong to several files. The message states how to provide separate times for
  // this file.
  fs::remove(folder_ / "poses_times.txt");
  Write("times.txt", "0\n1\n2\n");
  EXPECT_NE(Refusal(rows).find("times.txt:3: the number of times is 3, but "), std::string::npos);
  EXPECT_NE(Refusal(rows).find(
                "; expected one time for each pose, or a file poses_times.txt in the same folder"),
            std::string::npos)
      << Refusal(rows);
  Write("poses_times.txt", "5\n5\n");
  EXPECT_NE(Refusal(rows).find("poses_times.txt:2:1 t: '5' is not after the previous time"),
            std::string::npos);
}

TEST_F(TrajectoryFiles, EurocHasNanosecondsAndWFirst) {
  for (const char* more : {"", ",0,0,0,0,0,0,0,0,0"}) {
    const Trajectory t = Read(
        "#timestamp, p_RS_R_x [m], p_RS_R_y [m]\n"
        "1403636580838555648,4.6,-1.7,0.7,0.8,0.6,0,0" +
        std::string(more) + "\n");
    EXPECT_EQ(t.format, TrajectoryFormat::kEuroc);
    EXPECT_EQ(t.timestamps[0], 1403636580838555648);
    EXPECT_TRUE(t.orientations[0].isApprox(Eigen::Quaterniond(0.8, 0.6, 0, 0), 1e-15));
  }
}

TEST_F(TrajectoryFiles, AGivenFormatOverridesTheRow) {
  const Trajectory t = Read("1.5,1,2,3,0,0,0,1\n", TrajectoryFormat::kTum);
  EXPECT_EQ(t.timestamps[0], 1'500'000'000);
  EXPECT_EQ(t.orientations[0].w(), 1.0);
  EXPECT_EQ(Refusal("0 1 2 3 0 0 0 1\n", TrajectoryFormat::kKitti),
            "poses.txt:1:16: the row has 8 columns; expected 12, the upper three rows of "
            "world_from_body");
}

TEST_F(TrajectoryFiles, RowsThatAreNoneAreRefusedWithTheirPlace) {
  const std::string good = "0 1 2 3 0 0 0 1\n";
  EXPECT_EQ(Refusal("1 2 3\n"),
            "poses.txt:1: 3 columns; expected 8 columns (TUM), 20 (TUM with covariances), 12 "
            "(KITTI), or with commas 8, 11 or 17 (EuRoC)");
  const auto refusal_of_row = [&](const std::string& row) {
    std::string text = Refusal(good + row);
    EXPECT_TRUE(text.ends_with(kReadAsTum)) << text;
    return text.substr(0, text.size() - kReadAsTum.size());
  };
  EXPECT_EQ(refusal_of_row("1 1 2 3 0 0 0\n"),
            "poses.txt:2:14: the row has 7 columns; expected 8, t x y z qx qy qz qw");
  EXPECT_EQ(
      refusal_of_row("1 1 2 3 0 0 0"),
      "poses.txt:2:14: the last line is cut short: it has 7 columns; expected 8, t x y z qx qy qz "
      "qw");
  EXPECT_EQ(refusal_of_row("1 1 2 3 0 0 0 1 5\n"),
            "poses.txt:2:17: the row has 9 columns; expected 8, t x y z qx qy qz qw");
  EXPECT_EQ(refusal_of_row("1 1 nan 3 0 0 0 1\n"),
            "poses.txt:2:5 y: 'nan' is not finite; expected a finite number, or --skip-nan to "
            "leave out such rows");
  EXPECT_EQ(refusal_of_row("1 1 -1e300 3 0 0 0 1\n"),
            "poses.txt:2: a coordinate is beyond 1e15 m; expected a position in metres");
  EXPECT_EQ(refusal_of_row("1 1 2.x 3 0 0 0 1\n"),
            "poses.txt:2:5 y: '2.x' is not a number; expected a finite number");
  const std::string no_rotation =
      "poses.txt:1: columns 1-3, 5-7, 9-11 are not a rotation matrix; expected R with R R' = 1 to "
      "within 1e-3, and det R = 1; read as kitti (12 columns)";
  EXPECT_EQ(Refusal("1.1 0 0 0 0 1 0 0 0 0 1 0\n"), no_rotation);
  EXPECT_EQ(Refusal("-1 0 0 0 0 1 0 0 0 0 1 0\n"), no_rotation);
  EXPECT_EQ(Refusal("# nothing\n").substr(0, 40), "poses.txt:1: the file contains no poses;");
  EXPECT_THROW(ReadTrajectory(folder_ / "missing.txt"), Error);
}

TEST_F(TrajectoryFiles, OrbSlamWritesNanosecondsWithDecimals) {
  const Trajectory t = Read(
      "1403636579763555584.000000 0.1 0.2 0.3 0.6 0 0 0.8\n"
      "1403636579813555456.000000 0.1 0.2 0.3 0.6 0 0 0.8\n");
  EXPECT_EQ(t.timestamps, (std::vector<Timestamp>{1403636579763555584, 1403636579813555456}));
  EXPECT_TRUE(t.orientations[0].isApprox(Eigen::Quaterniond(0.8, 0.6, 0, 0), 1e-15));
}

TEST_F(TrajectoryFiles, VinsWritesTheVelocityAndACommaAtTheEnd) {
  const std::string pose = "1403636580838555648,4.6,-1.7,0.7,0.8,0.6,0,0";
  for (const char* more : {",", ", ", ",0.1,0.2,0.3", ",0.1,0.2,0.3,", ",0.1,0.2,0.3, \t"}) {
    SCOPED_TRACE(more);
    const Trajectory t = Read(pose + more + "\n");
    EXPECT_EQ(t.format, TrajectoryFormat::kEuroc);
    EXPECT_EQ(t.timestamps[0], 1403636580838555648);
    EXPECT_EQ(t.positions.col(0), Vector3d(4.6, -1.7, 0.7));
    EXPECT_TRUE(t.orientations[0].isApprox(Eigen::Quaterniond(0.8, 0.6, 0, 0), 1e-15));
  }
  EXPECT_EQ(Refusal(pose + ",0.1,,\n").substr(0, 36), "poses.txt:1: 10 columns with commas;");
}

TEST_F(TrajectoryFiles, EightColumnsWithCommasAreTumIfTheTimeHasDecimals) {
  const Trajectory t = Read("1403636580.05,1,2,3,0.6,0,0,0.8\n1403636581,1,2,3,0.6,0,0,0.8\n");
  EXPECT_EQ(t.format, TrajectoryFormat::kTum);
  EXPECT_EQ(t.timestamps[0], 1403636580050000000);
  EXPECT_TRUE(t.orientations[0].isApprox(Eigen::Quaterniond(0.8, 0.6, 0, 0), 1e-15));
  // The first time decides, and an error names the decision and its reason.
  EXPECT_EQ(Refusal("1403636580,1,2,3,0.6,0,0,0.8\n1403636580.05,1,2,3,0.6,0,0,0.8\n"),
            "poses.txt:2:1 t: '1403636580.05' is not a whole number; expected a whole number >= 0; "
            "read as euroc (8 columns with commas, t is a whole number); the "
            "alternative is --format tum");
}

TEST_F(TrajectoryFiles, AHeaderIsPassedOver) {
  const std::string pose = "1403636580838555648,4.6,-1.7,0.7,0.8,0.6,0,0";
  const Trajectory kimera = Read("timestamp,x,y,z,qw,qx,qy,qz,vx,vy,vz,bgx,bgy,bgz,bax,bay,baz\n" +
                                 pose + ",0,0,0,0,0,0,0,0,0\n");
  EXPECT_EQ(kimera.format, TrajectoryFormat::kEuroc);
  EXPECT_EQ(kimera.size(), 1);
  EXPECT_EQ(kimera.first_line, 2);
  const std::string tum = "timestamp tx ty tz qx qy qz qw\n1.5 1 2 3 0.6 0 0 0.8\n";
  for (const TrajectoryFormat format : {TrajectoryFormat::kDetect, TrajectoryFormat::kTum}) {
    EXPECT_EQ(Read(tum, format).timestamps, std::vector<Timestamp>{1'500'000'000});
  }
  EXPECT_EQ(Refusal("t,x\nt,x\n").substr(0, 36), "poses.txt:2: 2 columns with commas; ")
      << "only one row is a header";
  EXPECT_NE(Refusal("1.5x 1 2 3 0 0 0 1\n"), "") << "a row with numbers is not a header";
}

TEST_F(TrajectoryFiles, AHeaderThatNamesTheOrderOfTheQuaternionDecides) {
  const std::string pose = "1403636580838555648,4.6,-1.7,0.7,0.8,0.6,0,0\n";
  const Trajectory w_last = Read("stamp,x,y,z,qx,qy,qz,qw\n" + pose);
  EXPECT_EQ(w_last.format, TrajectoryFormat::kTum);
  EXPECT_EQ(w_last.timestamps[0], 1403636580838555648);
  EXPECT_TRUE(w_last.orientations[0].isApprox(Eigen::Quaterniond(0, 0.8, 0.6, 0), 1e-15));
  EXPECT_EQ(
      Read("stamp,p_x [m],p_y [m],p_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n" + pose).format,
      TrajectoryFormat::kEuroc);
  EXPECT_EQ(Refusal("t,x,y,z,qw,qx,qy,qz\n1.5,1,2,3,1,0,0,0\n"),
            "poses.txt:2:1 t: '1.5' is not a whole number; expected a whole number >= 0; "
            "read as euroc (8 columns with commas, qw first in the header); the alternative is "
            "--format tum");
  EXPECT_EQ(Refusal("t x y z qw qx qy qz\n1.5 1 2 3 1 0 0 0\n").substr(0, 54),
            "poses.txt:2: 8 columns, qw first in the header; expect");
}

TEST_F(TrajectoryFiles, RowsOfLostFramesAreLeftOutOnRequest) {
  const std::string text =
      "1 1 0 0 0 0 0 1\n2 nan nan nan nan nan nan nan\n3 -inf 0 0 0 0 0 1\n4 4 0 0 0 0 0 1\n";
  const Trajectory t = ReadFinite(text);
  EXPECT_EQ(t.positions.row(0), Eigen::RowVector2d(1, 4));
  EXPECT_EQ(t.timestamps, (std::vector<Timestamp>{1'000'000'000, 4'000'000'000}));
  EXPECT_EQ(WarningsOf(t),
            "poses.txt:2: 2 of 4 rows have a value that is not finite; they are left out\n");
  EXPECT_EQ(WarningsOf(ReadFinite("1 1 0 0 0 0 0 1\n")), "");
  // Other columns are not read, so their values do not matter.
  EXPECT_EQ(Read("1403636580838555648,4.6,-1.7,0.7,0.8,0.6,0,0,nan,nan,nan\n").size(), 1);
  try {
    ReadFinite("1 nan 0 0 0 0 0 1\n");
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what())
                  .find("poses.txt:1: the file contains no poses: each of 1 rows has a value that "
                        "is not finite"),
              std::string::npos)
        << error.what();
  }
}

TEST_F(TrajectoryFiles, ARowThatIsLeftOutKeepsItsTimeOfKitti) {
  const std::string pose = "1 0 0 0 0 1 0 0 0 0 1 0\n";
  const std::string lost = "nan nan nan nan nan nan nan nan nan nan nan nan\n";
  Write("times.txt", "0\n1\n2\n");
  const Trajectory t = ReadFinite(pose + lost + pose);
  EXPECT_EQ(t.timestamps, (std::vector<Timestamp>{0, 2'000'000'000}));
  EXPECT_EQ(t.rows, (std::vector<int>{0, 2}));
  EXPECT_EQ(t.row_count, 3);
  EXPECT_EQ(Refusal(lost),
            "poses.txt:1:1 r11: 'nan' is not finite; expected a finite number, or --skip-nan to "
            "leave out such rows; read as kitti (12 columns)");
}

TEST_F(TrajectoryFiles, QuaternionsOfTwoDecimalsAreNormalisedAndToldOf) {
  const std::string text = "0 1 2 3 0 0 0 1\n1 1 2 3 0.58 0.58 0.58 0.01\n2 1 2 3 0 0.05 0 1\n";
  const Trajectory t = Read(text);
  EXPECT_DOUBLE_EQ(t.orientations[1].norm(), 1.0);
  EXPECT_EQ(WarningsOf(t),
            "poses.txt:2 qx: 2 of 3 quaternions have a length that differs from 1 by more than "
            "1e-3; expected more decimals; they are normalised\n");
  for (const auto& [row, length] : {std::pair{"0 1 2 3 0 0 0 1.02\n", "1.020000"},
                                    {"0 1 2 3 0 0 0 0\n", "0.000000"},
                                    {"0 1 2 3 0 0 0 2\n", "2.000000"}}) {
    EXPECT_EQ(Refusal(row), std::string("poses.txt:1: quaternion of length ") + length +
                                "; expected a length within 0.01 of 1" + kReadAsTum);
  }
}

TEST_F(TrajectoryFiles, TimestampsThatCannotBeSecondsAreReadAsWhatTheyLookLike) {
  const std::string pose = " 1 2 3 0 0 0 1\n";
  struct Case {
    std::string first, second, unit;
  };
  for (const Case& c : {Case{"1311868163869700001", "1311868163903000001", "ns"},
                        {"0", "33333333", "ns"},
                        {"3600000000000", "3600033300000", "ns"},  // one hour after the start
                        {"1311868163869700", "1311868163903000", "us"},
                        {"0", "33333", "us"},
                        {"10800000000", "10800033300", "us"},  // three hours after the start
                        {"1311868163869.7", "1311868163903", "ms"}}) {
    SCOPED_TRACE(c.first + ' ' + c.unit);
    const std::string text = "# t\n" + c.first + pose + c.second + pose;
    EXPECT_EQ(WarningsOf(text),
              "poses.txt:2 t: '" + c.first +
                  "' and the following timestamps are not plausible as seconds; they are read as " +
                  c.unit + "; expected seconds, as in TUM\n");
    const Trajectory t = Read(text);
    EXPECT_NEAR(1e-9 * static_cast<double>(t.timestamps[1] - t.timestamps[0]), 0.0333, 1e-4);
  }
  // The timestamps are in us, with one pose per second.
  EXPECT_EQ(Read("0" + pose + "1000000" + pose).timestamps[1], 1'000'000'000);
  EXPECT_EQ(Read("1311868163869" + pose + "1311868168869" + pose).timestamps[1],
            1'311'868'168'869'000'000);  // the timestamps are in ms, 5 s apart
  EXPECT_EQ(Read("1311868163869700001" + pose).timestamps[0], 1311868163869700001);
  EXPECT_EQ(WarningsOf("1311868163.8697" + pose + "1311868200" + pose), "");
}

TEST_F(TrajectoryFiles, TimestampsThatNoTimestampHoldsAreRefusedWithTheirPlace) {
  const std::string pose = " 1 2 3 0 0 0 1\n";
  const std::string two = "1" + pose + "2" + pose;
  const auto beyond = [](const std::string& timestamp) {
    return "poses.txt:3 t: '" + timestamp + "' is beyond 292 years; expected seconds, as in TUM" +
           kReadAsTum;
  };
  for (const std::string timestamp : {"99999999999999999999", "9223372036.854775808", "-9.3e9"}) {
    EXPECT_EQ(Refusal(two + timestamp + pose), beyond(timestamp));
  }
  EXPECT_EQ(Refusal("9199999998" + pose + "9199999999" + pose + "9200000001" + pose),
            beyond("9200000001"));
  EXPECT_EQ(Refusal("9223372036854775807,1,2,3,1,0,0,0\n"),
            "poses.txt:1:1 t: '9223372036854775807' is beyond 292 years; expected ns, as in EuRoC; "
            "read as euroc (8 columns with commas, t is a whole number); the alternative is "
            "--format tum");
  EXPECT_EQ(Refusal("1e20" + pose),
            "poses.txt:1 t: '1e20' is beyond 292 years; expected seconds, as in TUM" + kReadAsTum);
  EXPECT_EQ(Read("9199999998.123456789" + pose).timestamps[0], 9199999998123456789);
  // The difference of two timestamps must not overflow either.
  EXPECT_EQ(
      Refusal("-9000000000" + pose + "-8999999999" + pose + "-8999999998" + pose + "9000000000" +
              pose),
      "poses.txt t: the timestamps span more than 292 years; expected timestamps of one clock");
}

TEST_F(TrajectoryFiles, ACovarianceThatIsNoneIsRefusedWithItsLine) {
  const std::string pose = " 1 2 3 0 0 0 1 ", good = "1 0 0 1 0 1";
  const auto refusal = [&](const std::string& orientation, const std::string& position) {
    return Refusal("0" + pose + good + ' ' + good + "\n1" + pose + orientation + ' ' + position +
                   '\n');
  };
  const std::string tum = "; read as tum (20 columns)";
  const std::string none = " is not positive semi-definite: its smallest eigenvalue is -";
  EXPECT_EQ(refusal(good, "1 0 0 1 0 -1"), "poses.txt:2: the covariance of the position" + none +
                                               "1; expected a positive semi-definite matrix" + tum);
  EXPECT_EQ(refusal("0.01 0.03 0 0.01 0 1", good),
            "poses.txt:2: the covariance of the orientation" + none +
                "0.02; expected a positive semi-definite matrix" + tum);
  EXPECT_EQ(refusal("-1e-9 0 0 -1e-9 0 -1e-9", good),
            "poses.txt:2: the covariance of the orientation" + none +
                "1e-09; expected a positive semi-definite matrix" + tum);
  // A singular covariance is valid. So is a covariance that is negative only because it was rounded
  // to six digits.
  EXPECT_EQ(refusal("0 0 0 0 0 0", "1 1 0 1 0 0"), "");
  EXPECT_EQ(refusal(good, "0.111111 0.111112 0 0.111111 0 1"), "");
}

TEST_F(TrajectoryFiles, TimestampsOutOfOrderAreSortedAndToldOf) {
  const std::string text = "1 1 0 0 0 0 0 1\n3 3 0 0 0 0 0 1\n2 2 0 0 0 0 0 1\n4 4 0 0 0 0 0 1\n";
  EXPECT_EQ(WarningsOf(text),
            "poses.txt:3 t: 2.000000 s is earlier than the previous timestamp; expected poses in "
            "the order of their timestamps; the poses are sorted\n");
  const Trajectory t = Read(text);
  EXPECT_EQ(t.positions.row(0), Eigen::RowVector4d(1, 2, 3, 4));
  EXPECT_TRUE(std::ranges::is_sorted(t.timestamps));
}

TEST_F(TrajectoryFiles, PosesOfADuplicateTimestampAreAllKeptAndItsLineIsNamed) {
  const std::string text = "1 1 0 0 0 0 0 1\n1 9 0 0 0 0 0 1\n2 2 0 0 0 0 0 1\n2 9 0 0 0 0 0 1\n";
  EXPECT_EQ(WarningsOf(text),
            "poses.txt:2 t: 1.000000 s is a duplicate timestamp, the first of 2 duplicate "
            "timestamps; expected each timestamp once; all poses are retained\n");
  EXPECT_EQ(Read(text).positions.row(0), Eigen::RowVector4d(1, 9, 2, 9));
  EXPECT_EQ(Read(text).timestamps.size(), 4u);
  // Sorting keeps the order of poses that have equal timestamps.
  EXPECT_EQ(WarningsOf("2 2 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n2 9 0 0 0 0 0 1\n"),
            "poses.txt:2 t: 1.000000 s is earlier than the previous timestamp; expected poses in "
            "the order of their timestamps; the poses are sorted\n"
            "poses.txt:3 t: 2.000000 s is a duplicate timestamp; expected each timestamp once; all "
            "poses are retained\n");
  EXPECT_EQ(Read("2 2 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n2 9 0 0 0 0 0 1\n").positions.row(0),
            Eigen::RowVector3d(1, 2, 9));
}

TEST_F(TrajectoryFiles, AFirstPoseThatIsTheIdentityInTheOtherOrderIsToldOf) {
  EXPECT_EQ(
      WarningsOf("0 0 0 0 1 0 0 0\n1 1 2 3 0.8 0.6 0 0\n"),
      "poses.txt:1 qx: the first pose is the identity if the quaternion is read with w first; "
      "expected qx qy qz qw, as in TUM\n");
  EXPECT_EQ(WarningsOf("0,0,0,0,0,0,0,1\n"),
            "poses.txt:1 qw: the first pose is the identity if the quaternion is read with w last; "
            "expected qw qx qy qz, as in EuRoC\n");
  EXPECT_EQ(WarningsOf("0 0 0 0 0 0 0 1\n"), "");
  // The first pose has a rotation of 180 degrees, but its position is not the origin, so there is
  // no warning.
  EXPECT_EQ(WarningsOf("0 0.1 0 0 1 0 0 0\n"), "");
}

TEST_F(TrajectoryFiles, AFolderIsARunAnEstimatorOrASequenceOfEuroc) {
  for (const char* name :
       {"run/truth.tum", "run/ekf/trajectory.tum", "run/ekf/trajectory_covariance.tum",
        "run/ekf/innovations.csv", "run/batch/trajectory.tum", "run/figures/a.svg",
        "euroc/mav0/state_groundtruth_estimate0/data.csv"}) {
    Write(name, "");
  }
  EXPECT_EQ(ReferenceAt(folder_ / "run").file, folder_ / "run/truth.tum");
  EXPECT_EQ(ReferenceAt(folder_ / "euroc").file,
            folder_ / "euroc/mav0/state_groundtruth_estimate0/data.csv");
  EXPECT_EQ(ReferenceAt(folder_ / "any.txt").file, folder_ / "any.txt");
  const std::vector<TrajectoryFile> all = EstimatesAt(folder_ / "run");
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].label, "batch");
  EXPECT_EQ(all[0].file, folder_ / "run/batch/trajectory.tum");
  EXPECT_TRUE(all[0].innovations.empty());
  EXPECT_EQ(all[1].label, "ekf");
  EXPECT_EQ(all[1].file, folder_ / "run/ekf/trajectory_covariance.tum");
  EXPECT_EQ(all[1].innovations, folder_ / "run/ekf/innovations.csv");
  EXPECT_EQ(EstimatesAt(folder_ / "run/ekf/").front().label, "ekf");
  EXPECT_EQ(EstimatesAt(folder_ / "any.txt").front().label, "any");
  for (const char* name : {"run/figures", "euroc"}) {
    EXPECT_THROW(EstimatesAt(folder_ / name), Error) << name;
  }
  EXPECT_THROW(ReferenceAt(folder_ / "run/figures"), Error);
}

TEST_F(TrajectoryFiles, TheTruthOfARunIsInItsFolderOrInThatOfItsEstimator) {
  for (const char* name : {"run/truth.tum", "run/ekf/trajectory.tum", "bare/ekf/trajectory.tum"}) {
    Write(name, "");
  }
  EXPECT_EQ(TruthOf(folder_ / "run").file, folder_ / "run/truth.tum");
  EXPECT_EQ(TruthOf(folder_ / "run/ekf").file, folder_ / "run/truth.tum");
  EXPECT_EQ(TruthOf(folder_ / "run/ekf/").file, folder_ / "run/truth.tum");
  for (const char* name : {"bare", "bare/ekf"}) {
    try {
      TruthOf(folder_ / name);
      FAIL() << name;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ExitCode::kInputMissing);
      EXPECT_NE(std::string(error.what()).find("run does not contain truth.tum"), std::string::npos)
          << error.what();
    }
  }
  try {
    TruthOf(folder_ / "run/truth.tum");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::kUsage);
  }
}

}  // namespace
}  // namespace alidade
