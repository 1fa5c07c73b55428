// SPDX-License-Identifier: Apache-2.0
//
// Tests track files with a fault. The test names contain the number of the fault.
#include "tracks_fixture.h"

namespace alidade::testing {
namespace {

const std::string kGood = "0,3,0,1\n0,3,1,2\n";
constexpr const char* kFrameTwo = "1,3,0,1\n1,3,1,2\n";

TEST_F(TracksTest, Fault27WrongColumns) {
  ExpectBadData(kGood + "1,3,0\n",
                "DIR/tracks.csv:3:6: the row has 3 columns; expected 4, "
                "frame,feature,dim,value");
  ExpectBadData(kGood + "1,3,0,5,6\n",
                "DIR/tracks.csv:3:9: the row has 5 columns; expected 4, "
                "frame,feature,dim,value");
  ExpectBadData("frame,feature,value\n" + kGood,
                "DIR/tracks.csv:1:20: the row has 3 columns; expected 4, "
                "frame,feature,dim,value");
}

TEST_F(TracksTest, Fault28NotANumber) {
  for (const std::string cell : {"abc", "6.5x", "0x10", "+-1", ""}) {
    ExpectBadData("0,3,0," + cell + "\n", "DIR/tracks.csv:1:7 value: '" + cell +
                                              "' is not a number; expected a finite number");
  }
  ExpectBadData("0,3.5,0,1\n",
                "DIR/tracks.csv:1:3 feature: '3.5' is not a whole number; expected a "
                "whole number >= 0");
  ExpectBadData(kGood + "x,3,0,1\n",
                "DIR/tracks.csv:3:1 frame: 'x' is not a whole number; expected "
                "a whole number >= 0");
}

TEST_F(TracksTest, Fault29NotFinite) {
  for (const std::string cell : {"nan", "inf", "-inf"}) {
    ExpectBadData("0,3,0," + cell + "\n", "DIR/tracks.csv:1:7 value: '" + cell +
                                              "' is not finite; expected a finite number");
  }
}

TEST_F(TracksTest, Fault30Overflow) {
  ExpectBadData("0,3,0,1e400\n",
                "DIR/tracks.csv:1:7 value: '1e400' is too large or too small; "
                "expected a finite number");
  ExpectBadData("0,99999999999999999999,0,1\n",
                "DIR/tracks.csv:1:3 feature: '99999999999999999999' is too large; expected at most "
                "9223372036854775807");
}

TEST_F(TracksTest, Fault30AFrameBeyondAllTimes) {
  ExpectBadData("99999999999999,3,0,1\n99999999999999,3,1,1\n",
                "DIR/tracks.csv:1: the time of frame 99999999999999 is beyond 292 years; expected "
                "frame numbers that start at 0");
}

TEST_F(TracksTest, Fault31NegativeFrame) {
  ExpectBadData("-1,3,0,1\n",
                "DIR/tracks.csv:1:1 frame: '-1' is negative; expected a whole number "
                ">= 0");
}

TEST_F(TracksTest, Fault32UnknownDim) {
  ExpectBadData("0,3,4,1\n",
                "DIR/tracks.csv:1:5 dim: '4' is unknown; expected 0 (u), 1 (v), "
                "2 (u_right or depth) or 3 (v_right)");
}

TEST_F(TracksTest, Fault33LineTooLong) {
  ExpectBadData(kGood + "1,3,0,1." + std::string(4089, '0') + "\n",
                "DIR/tracks.csv:3:1: the line is too long; expected at most 4096 bytes per line");
}

TEST_F(TracksTest, Fault34TruncatedLastLine) {
  ExpectBadData(kGood + "1,3,0",
                "DIR/tracks.csv:3:6: the last line is cut short: it has 3 columns; "
                "expected 4, frame,feature,dim,value");
  ExpectBadData(kGood + "1,3,0,5\n",
                "DIR/tracks.csv:3: feature 3 of frame 1 has no dim 1; "
                "expected both 0 (u) and 1 (v)");
}

TEST_F(TracksTest, Fault35SecondValue) {
  ExpectBadData(kGood + "# c\n0,3,0,1\n",
                "DIR/tracks.csv:4: there is a second value for frame 0, feature 3, "
                "dim 0; the first value is in line 1; expected one value");
}

TEST_F(TracksTest, Fault36FramesGoBackwards) {
  ExpectBadData("2,3,0,1\n2,3,1,2\n" + kGood,
                "DIR/tracks.csv:3:1 frame: '0' is smaller than in "
                "line 2; expected frames in increasing order");
}

TEST_F(TracksTest, Fault36TimesGoBackwards) {
  Write("timestamps.csv", "frame,t_s\n0,0.5\n1,0.5\n");
  ExpectBadData(kGood,
                "DIR/timestamps.csv:3:3 t_s: '0.5' is not later than in line 2; expected "
                "increasing times",
                "measures: pixel");
  Write("timestamps.csv", "0,0.5\n0,0.6\n");
  ExpectBadData(kGood,
                "DIR/timestamps.csv:2:1 frame: '0' is not larger than in line 1; expected "
                "increasing frame numbers",
                "measures: pixel");
}

TEST_F(TracksTest, Fault42EmptyFramesArePredictedThrough) {
  Write("timestamps.csv", "0,0\n1,1\n2,2\n");
  Write("tracks.csv", kGood);
  const auto frames = Frames("measures: pixel");
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_TRUE(frames[1].measurements.empty());
}

TEST_F(TracksTest, Fault43NothingAtAll) {
  for (const std::string text : {"", "# c\n\n"}) {
    Write("tracks.csv", text);
    ExpectError(ExitCode::kBadData,
                "DIR/tracks.csv" + std::string(text.empty() ? "" : ":2") +
                    ": the file contains no rows; expected rows frame,feature,dim,value",
                [&] { Open(); });
  }
  ExpectBadData("frame,feature,dim,value\n",
                "DIR/tracks.csv:1: the file contains no rows; expected a row below the header");
  Write("timestamps.csv", "");
  ExpectBadData(kGood,
                "DIR/timestamps.csv: the file contains no rows; expected a row `frame,t_s` for "
                "each frame",
                "measures: pixel");
}

TEST_F(TracksTest, Fault48ChangedWhileRead) {
  Write("tracks.csv", kGood);
  const auto source = Open();
  SourceFrame frame;
  std::ofstream(File(), std::ios::app) << kFrameTwo;
  ExpectError(ExitCode::kIo, "DIR/tracks.csv:4: the file changed while it was read", [&] {
    while (source->Next(frame)) {
    }
  });
}

TEST_F(TracksTest, Fault49QuaternionNotUnit) {
  Write("groundtruth.tum", "0 1 2 3 0 0 0 1\n1 1 2 3 0 0 0.05 1\n");
  ExpectBadData(kGood + "20,3,0,1\n20,3,1,2\n",
                "DIR/groundtruth.tum:2: the length of the quaternion is "
                "1.001249; expected a length within 1e-3 of 1");
}

TEST_F(TracksTest, AFrameWithoutATime) {
  Write("timestamps.csv", "0,0\n2,2\n");
  ExpectBadData(kGood + kFrameTwo,
                "DIR/tracks.csv:3: frame 1 is not in " + (folder_ / "timestamps.csv").string() +
                    "; expected a time for every frame",
                "measures: pixel");
  Write("tracks.csv", kGood);
  fs::remove(folder_ / "timestamps.csv");
  ExpectError(
      ExitCode::kBadConfig,
      "run.yaml:1:16 source.path: there is no timestamps.csv next to the tracks; expected this "
      "file, or 'rate_hz'",
      [&] { Open("measures: pixel"); });
}

TEST_F(TracksTest, FaultsOfOdometry) {
  Write("odometry.csv", "frame,wx_rad_s,wy_rad_s,wz_rad_s,vx_m_s,vy_m_s\n");
  ExpectBadData(kGood,
                "DIR/odometry.csv:1: there is no column 'vz_m_s'; expected a header with "
                "frame,vx_m_s,vy_m_s,vz_m_s,wx_rad_s,wy_rad_s,wz_rad_s");
  const std::string header = "frame,wx_rad_s,wy_rad_s,wz_rad_s,vx_m_s,vy_m_s,vz_m_s\n";
  Write("odometry.csv", header + "1,0,0,0,0,0,0\n1,0,0,0,0,0,0\n");
  ExpectBadData(kGood + kFrameTwo,
                "DIR/odometry.csv:3:1 frame: '1' is not larger than in line 2; "
                "expected increasing frame numbers");
  Write("odometry.csv", header + "0,0,0,nan,0,0,0\n");
  ExpectBadData(kGood,
                "DIR/odometry.csv:2:7 wz_rad_s: 'nan' is not finite; expected a finite "
                "number");
}

TEST_F(TracksTest, RefusesWhatCannotBeRead) {
  ExpectError(ExitCode::kInputMissing,
              "run.yaml:1:16 source.path: cannot read 'DIR/tracks.csv': No such file or directory; "
              "expected a readable file",
              [&] { Open(); });
}

}  // namespace
}  // namespace alidade::testing
