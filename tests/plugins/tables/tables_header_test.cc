// SPDX-License-Identifier: Apache-2.0
//
// Tests the header and the separator of tables as other programs write them.
#include "tables_fixture.h"

namespace alidade::testing {
namespace {

using Text = std::vector<std::string>;

TEST_F(Tables, DetectsTheSeparator) {
  for (const char* separator : {",", ";", "\t", "|", " ", "  ", " ; "}) {
    const std::string s = separator;
    Write("t_s" + s + "u" + s + "v\n0" + s + "1" + s + "2\n");
    EXPECT_EQ(Shown(Frames("path: a.csv\nstreams: {z: [u, v]}\n")), (Text{"0 s0=1,2"})) << s;
  }
}

TEST_F(Tables, OtherSeparatorsOccurInTheNames) {
  Write("t_s,z; a | b,w\n0,1,2\n");
  EXPECT_EQ(Shown(Frames("path: a.csv\nstreams: {z: ['z; a | b', w]}\n")), (Text{"0 s0=1,2"}));
  Write("t_s;x, east;w y\n0;1;2\n");
  EXPECT_EQ(Shown(Frames("path: a.csv\nstreams: {z: ['x, east', w y]}\n")), (Text{"0 s0=1,2"}));
  Write("# t_s;x, east\n0;1\n");
  EXPECT_EQ(Shown(Frames("path: a.csv\nstreams: {z: 'x, east'}\n")), (Text{"0 s0=1"}));
  Write("0;1;2,5\n");
  EXPECT_EQ(Shown(Frames("path: a.csv\ncolumns: [t_s, z, text]\nstreams: {z: z}\n")),
            (Text{"0 s0=1"}));
}

// The first separator of the line is that of the message.
TEST_F(Tables, ATableWithoutColumnsOfTheConfigHasASeparator) {
  Write("t;east\n0;1\n");
  ExpectBadConfig("path: a.csv\ntime: {column: s}\nstreams: {z: z}\n",
                  "run.yaml:2:16 time.column: there is no column 's' in FILE; expected one of t, "
                  "east; did you mean 't'?");
}

TEST_F(Tables, SuggestsTheColumnWithAUnit) {
  Write("t_s,wx,wy,wz [deg/s]\n0,1,2,3\n");
  ExpectBadConfig("path: a.csv\nstreams: {gyro: wz}\n",
                  "run.yaml:2:17 streams.gyro: there is no column 'wz' in FILE; expected one of "
                  "t_s, wx, wy, wz [deg/s]; did you mean 'wz [deg/s]'?");
}

TEST_F(Tables, ANumberIsNoColumn) {
  Write("t_s,x\n0,1\n");
  ExpectBadConfig("path: a.csv\nstreams: {z: {columns: x, sigma: 0.03}}\n",
                  "run.yaml:2:34 streams.z.sigma: '0.03' is a number, not a column of FILE; "
                  "expected the name of a column; a constant noise belongs to the sensor, as in "
                  "'sigma_m: 0.1'");
}

TEST_F(Tables, ShowsTheMapOfATime) {
  Write("stamp,x\n0,1\n");
  ExpectBadConfig("path: a.csv\ntime: stamp\nstreams: {z: x}\n",
                  "run.yaml:2:7 time: 'stamp'; expected a map, as in {column: stamp}");
}

TEST_F(Tables, NamesAFolderThatDoesNotExist) {
  ExpectError(ExitCode::kInputMissing,
              "run.yaml:1:7 path: there is no folder '" + (folder_ / "lgo").string() +
                  "'; expected the folder of the files",
              [&] { Frames("path: lgo\nfiles: [{path: a.csv, streams: {x: x}}]\n"); });
}

TEST_F(Tables, AGivenSeparatorIsUsed) {
  Write("a;b,z\n1;2,3\n");
  EXPECT_EQ(Shown(Frames("path: a.csv\nseparator: ','\nrate_hz: 1\nstreams: {z: z}\n")),
            (Text{"0 s0=3"}));
}

TEST_F(Tables, BlanksAreOneSeparator) {
  Write("  t_s  \tz \n0 \t 1\n  1   2  \n");
  EXPECT_EQ(Shown(Frames("path: a.csv\nseparator: ' '\nstreams: {z: z}\n")),
            (Text{"0 s0=1", "1000 s0=2"}));
  ExpectBadData("t_s z\n0 1 2\n",
                "FILE:2:5: the line has 3 columns; expected 2 columns, as in line 1",
                "path: a.csv\nstreams: {z: z}\n");
}

// EuRoC: the header is a comment.
TEST_F(Tables, ACommentNamesTheColumnsOfNumbers) {
  Write(
      "#timestamp [ns],w_RS_S_x [rad s^-1],a_RS_S_x [m s^-2]\n"
      "1403715273262142976,-0.1,9.8\n1403715273267142976,-0.2,9.7\n");
  const auto frames = Frames(
      "path: a.csv\ntime: {column: 'timestamp [ns]', unit: ns}\nstreams: {imu: ['w_RS_S_x [rad "
      "s^-1]', 'a_RS_S_x [m s^-2]']}\n");
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[0].timestamp, 1403715273262142976);
  EXPECT_EQ(frames[1].measurements[0].values, (std::vector<double>{-0.2, 9.7}));
}

// TUM: several comments, of which the last names the columns.
TEST_F(Tables, TheLastCommentNamesTheColumns) {
  Write(
      "# ground truth trajectory\n# file: 'a b c d'\n# timestamp tx ty tz qx qy qz qw\n"
      "1311868164.3600 1 2 3 0 0 0 1\n");
  EXPECT_EQ(Shown(Frames("path: a.csv\ntime: {column: timestamp}\ntruth: {position: [tx, ty, tz]}\n"
                         "streams: {pose: [tx, qw]}\n")),
            (Text{"1311868164360 s0=1,1 t0=1,2,3"}));
}

TEST_F(Tables, ACommentOfAnotherWidthIsNoHeader) {
  Write("# made by hand\n0,1,2\n1,2,3\n");
  ExpectBadConfig("path: a.csv\nstreams: {z: z}\n",
                  "run.yaml:1:1: there is no column 't_s' in FILE, because its first line contains "
                  "numbers, not names; expected a first line that names the columns, as in "
                  "'t_s,depth', or 'columns: [t_s, depth]' in the config");
  // A header below the comment remains the header.
  EXPECT_EQ(Frames("# a, b\nt_s,z\n0,1\n", "path: a.csv\nstreams: {z: z}\n").size(), 1u);
}

TEST_F(Tables, TheConfigNamesTheColumnsOfATableWithoutHeader) {
  const std::string config =
      "path: a.csv\ncolumns: [t, x, note]\ntime: {column: t}\n"
      "streams: {x: x}\n";
  Write("# t u v\n0 1 a\n1 2 b\n");
  EXPECT_EQ(Shown(Frames(config)), (Text{"0 s0=1", "1000 s0=2"}));
  EXPECT_EQ(Shown(Frames(config + "blind_after: 0.5\n")), (Text{"0 s0=1", "1000"}));
  ExpectBadData("0 1\n", "FILE:1:4: the line has 2 columns; expected 3 columns, as in 'columns'",
                config);
}

TEST_F(Tables, BlindAfterCountsTheRowsBelowACommentHeader) {
  Write("# t_s x\n0 1\n1 2\n2 3\n3 4\n");
  EXPECT_EQ(Shown(Frames("path: a.csv\nblind_after: 0.5\nstreams: {x: x}\n")),
            (Text{"0 s0=1", "1000 s0=2", "2000", "3000"}));
}

}  // namespace
}  // namespace alidade::testing
