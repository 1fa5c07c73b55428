// SPDX-License-Identifier: Apache-2.0
#include "plugins/tables/tables.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstring>

#include "support/comma_locale.h"
#include "tables_fixture.h"

namespace alidade::testing {
namespace {

// ---- reading tables ---------------------------------------------------------------------------

TEST_F(Tables, ReadsNamedColumns) {
  const auto frames =
      Frames(std::string(kHeader) + "0,6.5,1.0,58\n0.103007,6.75,1.25,57\n", kDepthConfig);
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(Timestamps(frames), (std::vector<Timestamp>{0, 103'007'000}));
  ASSERT_EQ(Held(frames[1]), "0 1 | 0");
  EXPECT_EQ(frames[1].measurements[0].values, std::vector<double>{6.75});
  EXPECT_EQ(frames[1].measurements[1].values, std::vector<double>{1.0 / 1.25});
  EXPECT_EQ(frames[1].measurements[1].timestamp, 103'007'000);
  EXPECT_EQ(frames[1].measurements[1].landmark, -1);
  EXPECT_EQ(frames[1].truth[0], std::vector<double>{57.0});
}

TEST_F(Tables, GivesStreamsAndTruthsInTheOrderWritten) {
  Write("t_s,u,v,d\n0,1,2,3\n");
  const auto source = Open("path: a.csv\nstreams: {pixel: [v, u], disparity: d}\n");
  ASSERT_EQ(source->streams().size(), 2u);
  EXPECT_EQ(source->streams()[0].name, "pixel");
  EXPECT_EQ(source->streams()[0].size, 2);
  EXPECT_EQ(source->streams()[1].size, 1);
  EXPECT_TRUE(source->truths().empty());
  EXPECT_EQ(source->size(), -1);
  SourceFrame frame;
  ASSERT_TRUE(source->Next(frame));
  EXPECT_EQ(frame.measurements[0].values, (std::vector<double>{2.0, 1.0}));
  EXPECT_FALSE(source->Next(frame));
}

TEST_F(Tables, GainAndReciprocalScaleTheColumn) {
  // The expected values are 1000 mm = 1 m and 3 / 4 = 0.75.
  const auto frames = Frames("t_s,a,b\n0,1000,4\n",
                             "path: a.csv\nstreams: {m: {columns: a, gain: 1e-3}, r: {columns: "
                             "[b], reciprocal: true, gain: 3}}\n");
  EXPECT_DOUBLE_EQ(frames[0].measurements[0].values[0], 1.0);
  EXPECT_DOUBLE_EQ(frames[0].measurements[1].values[0], 0.75);
}

// The known numbers of a range are the position of the satellite. If one of these numbers is
// missing, the frame has no measurement of the range.
TEST_F(Tables, ReadsKnownNumbersWithAMeasurement) {
  const std::string config =
      "path: a.csv\nstreams: {range: {columns: r, gain: 1e3, known: [x, y]}, other: r}\n";
  Write("t_s,r,x,y\n0,21.5,1,2\n1,22,3,\n");
  const auto source = Open(config);
  EXPECT_EQ(source->streams()[0].known, 2);
  EXPECT_EQ(source->streams()[1].known, 0);
  const auto frames = Frames("t_s,r,x,y\n0,21.5,1,2\n1,22,3,\n", config);
  ASSERT_EQ(Held(frames[0]), "0 1 |");
  EXPECT_EQ(frames[0].measurements[0].values, std::vector<double>{21500.0});
  EXPECT_EQ(frames[0].measurements[0].known, (std::vector<double>{1.0, 2.0}))
      << "the gain does not apply to known numbers";
  EXPECT_TRUE(frames[0].measurements[1].known.empty());
  ASSERT_EQ(Held(frames[1]), "1 |");
  EXPECT_TRUE(frames[1].measurements[0].known.empty());
}

// The table has one row per satellite: two rows at the first time and one row at the second time.
// The true value is that of the first row that contains a true value.
TEST_F(Tables, RowsOfOneTimeAreOneFrameWhereTimesRepeat) {
  const std::string config =
      "path: a.csv\ntime: {column: t_s, repeats: true}\n"
      "streams: {range: {columns: r, known: [x]}, speed: v}\ntruth: {depth: d}\n";
  Write("t_s,r,x,v,d\n0,21,1,,\n0,22,2,7,58\n0,,,,59\n1,23,3,,\n");
  const auto source = Open(config);
  SourceFrame frame;
  ASSERT_TRUE(source->Next(frame));
  EXPECT_EQ(source->place().line, 4) << "the last row of the frame, not the row after it";
  ASSERT_EQ(Held(frame), "0 0 1 | 0");
  EXPECT_EQ(frame.measurements[0].values, std::vector<double>{21.0});
  EXPECT_EQ(frame.measurements[0].known, std::vector<double>{1.0});
  EXPECT_EQ(frame.measurements[1].values, std::vector<double>{22.0});
  EXPECT_EQ(frame.measurements[1].known, std::vector<double>{2.0});
  EXPECT_EQ(frame.measurements[2].values, std::vector<double>{7.0});
  EXPECT_EQ(frame.truth[0], std::vector<double>{58.0});
  ASSERT_TRUE(source->Next(frame));
  EXPECT_EQ(frame.timestamp, 1'000'000'000);
  ASSERT_EQ(Held(frame), "0 |");
  EXPECT_EQ(frame.measurements[0].known, std::vector<double>{3.0});
  EXPECT_FALSE(source->Next(frame));
}

// A bad value does not invalidate the previous frame. A row with an unreadable time may belong to
// the previous frame, so this frame is not emitted.
TEST_F(Tables, AFrameBeforeABadRowIsGivenOutWhereItIsWhole) {
  Write("t_s,r\n0,21\n0,22\n1,x\n");
  const auto source =
      Open("path: a.csv\ntime: {column: t_s, repeats: true}\nstreams: {range: r}\n");
  SourceFrame frame;
  ASSERT_TRUE(source->Next(frame));
  EXPECT_EQ(Held(frame), "0 0 |");
  ExpectError(ExitCode::kBadData,
              "FILE:4:3 r: 'x' is not a number; expected a finite number, or "
              "'missing: [x]'",
              [&] { source->Next(frame); });
  ExpectBadData("t_s,r\n1,21\n0,22\n",
                "FILE:3:1 t_s: '0' is earlier than in line 2; expected increasing times, or "
                "'out_of_sequence.policy: buffer' or 'rollback'",
                "path: a.csv\ntime: {column: t_s, repeats: true}\nstreams: {range: r}\n");
  Write("t_s,r\n0,21\nO,22\n");
  const auto cut = Open("path: a.csv\ntime: {column: t_s, repeats: true}\nstreams: {range: r}\n");
  ExpectError(ExitCode::kBadData, "FILE:3:1 t_s: 'O' is not a number; expected a finite number",
              [&] { cut->Next(frame); });
}

TEST_F(Tables, AcceptsCommentsCarriageReturnsAndByteOrderMark) {
  const auto frames = Frames(
      "\xEF\xBB\xBF# made by hand\r\n\r\nt_s , \"z\"\r\n# rows\r\n0, +1.5\r\n\r\n"
      "1,\t-2e0 \r\n2,.5",
      "path: a.csv\nstreams: {depth: z}\n");
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames[0].measurements[0].values[0], 1.5);
  EXPECT_EQ(frames[1].measurements[0].values[0], -2.0);
  // The last row is complete, although the line has no line feed.
  EXPECT_EQ(frames[2].measurements[0].values[0], 0.5);
}

TEST_F(Tables, IgnoresColumnsThatNobodyNames) {
  const auto frames = Frames("t_s,note,z\n0,a car,1\n1,nan,2\n", "path: a.csv\nstreams: {z: z}\n");
  EXPECT_EQ(frames.size(), 2u);
}

TEST_F(Tables, SeparatesAsTold) {
  const std::string text = "t_s;z\n0;1\n";
  EXPECT_EQ(Frames(text, "path: a.csv\nseparator: ;\nstreams: {z: z}\n").size(), 1u);
  Write("t_s\tz\tw\n0\t\t5\n");
  EXPECT_EQ(Held(Frames("path: a.csv\nseparator: \"\\t\"\nstreams: {z: z, w: w}\n")[0]), "1 |");
  ExpectBadConfig("path: a.csv\nseparator: \"1\"\nstreams: {z: z}\n",
                  "run.yaml:2:12 separator: this text is not a valid separator; expected one "
                  "character that does not occur in numbers, such as ';' or \"\\t\"");
}

TEST_F(Tables, EmptyCellIsMissing) {
  const auto frames = Frames(std::string(kHeader) + "0,,1,5\n1,2, ,\n2,,,\n", kDepthConfig);
  EXPECT_EQ(Held(frames[0]), "1 | 0");
  EXPECT_EQ(Held(frames[1]), "0 |");
  EXPECT_EQ(Held(frames[2]), "|");
}

TEST_F(Tables, PartOfAVectorIsMissingAsAWhole) {
  const auto frames = Frames("t_s,u,v\n0,1,\n1,1,2\n", "path: a.csv\nstreams: {pixel: [u, v]}\n");
  EXPECT_EQ(Held(frames[0]), "|");
  EXPECT_EQ(Held(frames[1]), "0 |");
}

TEST_F(Tables, FramesHoldNothingOfTheFrameBefore) {
  Write("t_s,a,b\n0,1,2\n1,,3\n");
  const auto source = Open("path: a.csv\nstreams: {a: a, b: b}\n");
  SourceFrame frame;
  source->Next(frame);
  frame.measurements[0].covariance = {9.0};
  frame.measurements[0].landmark = 4;
  ASSERT_TRUE(source->Next(frame));
  ASSERT_EQ(Held(frame), "1 |");
  EXPECT_EQ(frame.measurements[0].values, std::vector<double>{3.0});
  EXPECT_TRUE(frame.measurements[0].covariance.empty());
  EXPECT_EQ(frame.measurements[0].landmark, -1);
}

TEST_F(Tables, MissingTextsAreAddedToTheEmptyCell) {
  const std::string config = "path: a.csv\nmissing: [nan, \"-\"]\nstreams: {z: z}\n";
  const auto frames = Frames("t_s,z\n0,nan\n1,-\n2,\n3,4\n", config);
  EXPECT_EQ(Held(frames[0]) + Held(frames[1]) + Held(frames[2]) + Held(frames[3]), "|||0 |");
  ExpectBadData("t_s,z\n0,NaN\n",
                "FILE:2:3 z: 'NaN' is not finite; expected a finite number, or "
                "'missing: [nan, \"-\", NaN]'",
                config);
}

TEST_F(Tables, TimeHasAUnit) {
  const auto timestamps = [&](const std::string& unit, const std::string& rows) {
    return Timestamps(Frames(
        "t\n" + rows, "path: a.csv\ntime: {column: t, unit: " + unit + "}\nstreams: {z: t}\n"));
  };
  EXPECT_EQ(timestamps("s", "-0.5\n0.0000000014\n0.0000000016\n"),
            (std::vector<Timestamp>{-500'000'000, 1, 2}));
  EXPECT_EQ(timestamps("ms", "33\n+66.5\n1e2\n"),
            (std::vector<Timestamp>{33'000'000, 66'500'000, 100'000'000}));
  EXPECT_EQ(timestamps("us", "-.0006\n.5\n1.\n"), (std::vector<Timestamp>{-1, 500, 1000}));
  EXPECT_EQ(timestamps("ns", "1\n2\n"), (std::vector<Timestamp>{1, 2}));
}

TEST_F(Tables, TimeSince1970KeepsEveryNanosecond) {
  // Near 1.4e18, adjacent doubles differ by 256. Near 1.4e9 they differ by 2.4e-7.
  const Timestamp first = 1'403'636'579'763'555'584;
  EXPECT_EQ(Timestamps(Frames("t,z\n1403636579763555584,1\n1403636579763555585,1\n",
                              "path: a.csv\ntime: {column: t, unit: ns}\nstreams: {z: z}\n")),
            (std::vector<Timestamp>{first, first + 1}));
  EXPECT_EQ(Timestamps(Frames("t_s,z\n1403636579.763555584,1\n1403636579.763555585,1\n",
                              "path: a.csv\nstreams: {z: z}\n")),
            (std::vector<Timestamp>{first, first + 1}));
}

TEST_F(Tables, RateStandsInForTime) {
  const std::string config = "path: a.csv\nrate_hz: 30\nstreams: {z: z}\n";
  const auto frames = Frames("z\n1\n\n2\n", config);  // a blank line is a missing value
  EXPECT_EQ(Timestamps(frames), (std::vector<Timestamp>{0, 33'333'333, 66'666'667}));
  EXPECT_EQ(Held(frames[1]), "|");
  ExpectBadData("z,w\n1,2\n\n2,3\n",
                "FILE:3:1: the line has 1 column; expected 2 columns, as in line 1", config);
}

TEST_F(Tables, NumbersDoNotDependOnTheLocale) {
  const CommaLocale comma;
  if (!comma.active()) GTEST_SKIP() << "localedef is not available";
  EXPECT_EQ(Frames("t_s,z\n0.5,1.25\n", "path: a.csv\nstreams: {z: z}\n")[0].measurements[0].values,
            std::vector<double>{1.25});
}

TEST_F(Tables, LinesAcrossTheBufferAreWhole) {
  // The table has 20000 rows of about 30 bytes, about ten times the size of the buffer.
  std::string text = "t_s,z\n";
  for (int i = 0; i < 20000; ++i) {
    text += std::to_string(i) + "," + std::to_string(i) + ".000000000000000000\n";
  }
  const auto frames = Frames(text, "path: a.csv\nstreams: {z: z}\n");
  ASSERT_EQ(frames.size(), 20000u);
  for (int i = 0; i < 20000; ++i) {
    ASSERT_EQ(frames[static_cast<std::size_t>(i)].measurements[0].values[0], i);
  }
}

// ---- blind_after --------------------------------------------------------------------------------

TEST_F(Tables, BlindAfterDropsTheFirstStreamInTheRestOfTheSeries) {
  std::string text = std::string("# c\n") + kHeader;
  for (int i = 0; i < 7; ++i) text += std::to_string(i) + ",1,2,3\n\n";
  Write(text);
  const auto seen = [&](const std::string& share) {
    int count = 0;
    bool ended = false;
    const auto source = Open(kDepthConfig + ("blind_after: " + share + "\n"));
    // A fraction of 1 drops nothing, so the rows need not be counted.
    EXPECT_EQ(source->size(), share == "1" ? -1 : 7);
    for (SourceFrame frame; source->Next(frame);) {
      const std::string held = Held(frame);
      EXPECT_TRUE(held == "0 1 | 0" || held == "1 | 0") << held;
      ended |= held == "1 | 0";
      EXPECT_EQ(held == "1 | 0", ended);  // all rows after the first blind row are blind
      count += ended ? 0 : 1;
    }
    return count;
  };
  // Row k = 0 .. 6 is not blind if k < 7 F. F is the given fraction.
  EXPECT_EQ(seen("0"), 0);
  EXPECT_EQ(seen("0.1"), 1);
  EXPECT_EQ(seen("0.5"), 4);
  EXPECT_EQ(seen("1"), 7);
}

TEST_F(Tables, BlindAfterIsExactWhereTheShareIs) {
  // Tests the rounding: in double precision 0.07 * 100 is 7.000000000000001.
  std::string text = "t_s,z\n";
  for (int i = 0; i < 100; ++i) text += std::to_string(i) + ",1\n";
  Write(text);
  int seen = 0;
  for (const SourceFrame& frame : Frames("path: a.csv\nblind_after: 0.07\nstreams: {z: z}\n")) {
    seen += static_cast<int>(frame.measurements.size());
  }
  EXPECT_EQ(seen, 7);
}

TEST_F(Tables, BlindNamesTheStreams) {
  Write(std::string(kHeader) + "0,1,2,3\n1,1,2,3\n");
  const std::string config = kDepthConfig + std::string("blind_after: 0.5\n");
  EXPECT_EQ(Held(Frames(config + "blind: inverse_scale\n")[1]), "0 | 0");
  EXPECT_EQ(Held(Frames(config + "blind: [inverse_scale, disparity]\n")[1]), "| 0");
  ExpectBadConfig(config + "blind: [disparty]\n",
                  "run.yaml:5:9 blind[0]: there is no stream 'disparty'; expected one of "
                  "disparity, inverse_scale; did you mean 'disparity'?");
  ExpectBadConfig(kDepthConfig + std::string("blind: disparity\n"),
                  "run.yaml:4:8 blind: this key has no effect without 'blind_after'; expected "
                  "the key 'blind_after', too");
}

TEST_F(Tables, BlindAfterNeedsRowsInChronologicalOrder) {
  Write(std::string(kHeader) + "1,1,2,3\n0,1,2,3\n");
  any_order_ = true;
  ExpectBadConfig(kDepthConfig + std::string("blind_after: 0.5\n"),
                  "run.yaml:4:14 blind_after: this key counts rows in the order of the file, but "
                  "'out_of_sequence.policy' reorders them; expected 'out_of_sequence.policy: "
                  "reject', which requires a file in chronological order");
  EXPECT_EQ(Frames(kDepthConfig + std::string("blind_after: 1\n")).size(), 2u);
}

TEST_F(Tables, BlindAfterNeedsAFileThatCanBeReadTwice) {
  ASSERT_EQ(mkfifo(File().c_str(), 0600), 0);
  const int both_ends = open(File().c_str(), O_RDWR);
  ASSERT_EQ(write(both_ends, kHeader, std::strlen(kHeader)), std::strlen(kHeader));
  ExpectBadConfig(kDepthConfig + std::string("blind_after: 0.5\n"),
                  "run.yaml:4:14 blind_after: 'FILE' is a pipe, which cannot be read twice; "
                  "expected a regular file, whose rows can be counted first");
  ASSERT_EQ(write(both_ends, kHeader, std::strlen(kHeader)), std::strlen(kHeader));
  ASSERT_EQ(write(both_ends, "0,1,2,3\n", 8), 8);
  const auto source = Open(kDepthConfig + std::string("blind_after: 1\n"));
  SourceFrame frame;
  ASSERT_TRUE(source->Next(frame));
  EXPECT_EQ(Held(frame), "0 1 | 0");
  close(both_ends);
}

}  // namespace
}  // namespace alidade::testing
