// SPDX-License-Identifier: Apache-2.0
//
// Tests tables that are merged by time, delays and gaps.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <thread>

#include "alidade/io/log.h"
#include "support/peak_memory.h"
#include "tables_fixture.h"

namespace alidade::testing {
namespace {

using Text = std::vector<std::string>;

constexpr const char* kTwoFiles =
    "files:\n"
    "- {path: a.csv, time: {column: t, unit: ms}, streams: {fast: x}}\n"
    "- {path: b.csv, time: {column: t_ns, unit: ns, offset_s: -0.5}, separator: ';',\n"
    "   missing: nan, streams: {slow: [u, v]}, truth: {depth: z}}\n";

TEST_F(Tables, MergesFilesByTime) {
  Write("a.csv", "t,x\n0,1\n10,2\n20,3\n30,4\n");
  Write("b.csv", "t_ns;u;v;z\n490000000;0;0;7\n510000000;5;6;8\n525000000;nan;6;9\n");
  EXPECT_EQ(Shown(Frames(kTwoFiles)), (Text{"-10 s1=0,0 t0=7", "0 s0=1", "10 s0=2 s1=5,6 t0=8",
                                            "20 s0=3", "25 t0=9", "30 s0=4"}));
}

TEST_F(Tables, RowsOfSeveralFilesArriveInTheOrderOfTheirTimes) {
  any_order_ = true;
  Write("a.csv", "t,x\n0,1\n10,2\n30,3\n");
  Write("b.csv", "t_ns;u;v;z\n505000000;5;6;8\n520000000;7;8;9\n");
  EXPECT_EQ(Shown(Frames(kTwoFiles)),
            (Text{"0 s0=1", "5 s1=5,6 t0=8", "10 s0=2", "20 s1=7,8 t0=9", "30 s0=3"}));
}

TEST_F(Tables, StreamsAndTruthsOfAllFilesHaveOneOrder) {
  Write("a.csv", "t,x\n0,1\n");
  Write("b.csv", "t_ns;u;v;z\n0;1;2;3\n");
  const auto source = Open(kTwoFiles);
  ASSERT_EQ(source->streams().size(), 2u);
  EXPECT_EQ(source->streams()[1].name, "slow");
  EXPECT_EQ(source->streams()[1].size, 2);
  EXPECT_EQ(source->truths().at(0).name, "depth");
}

TEST_F(Tables, PlaceIsThatOfTheLastRowOfAFrame) {
  Write("a.csv", "t,x\n0,1\n10,2\n");
  Write("b.csv", "t_ns;u;v;z\n510000000;5;6;8\n");
  const auto source = Open(kTwoFiles);
  SourceFrame frame;
  ASSERT_TRUE(source->Next(frame));
  EXPECT_EQ(source->place().file, (folder_ / "a.csv").string());
  EXPECT_EQ(source->place().line, 2);
  ASSERT_TRUE(source->Next(frame));
  EXPECT_EQ(source->place().file, (folder_ / "b.csv").string());
}

TEST_F(Tables, FilesAreInTheFolderOfTheSource) {
  fs::create_directory(folder_ / "log");
  Write("log/a.csv", "t_s,x\n0,1\n");
  EXPECT_EQ(Frames("path: log\nfiles: [{path: a.csv, streams: {x: x}}]\n").size(), 1u);
}

TEST_F(Tables, EachNameIsInOneFile) {
  Write("a.csv", "t_s,x\n0,1\n");
  ExpectBadConfig(
      "files: [{path: a.csv, streams: {x: x}}, {path: a.csv, streams: {x: x}}]\n",
      "run.yaml:1:41 files[1]: 'x' is also in an earlier file; expected each stream and each "
      "truth in one file");
  ExpectBadConfig("files: [a.csv]\n",
                  "run.yaml:1:9 files[0]: 'a.csv'; expected a map, as in {path: gps.csv, "
                  "streams: {gps: [x, y]}}");
}

TEST_F(Tables, AFaultNamesItsFile) {
  Write("a.csv", "t_s,x\n0,1\n1,x\n");
  Write("b.csv", "t_s,x\n0,1\n1,2\n");
  ExpectError(ExitCode::kBadData,
              "FILE:3:3 x: 'x' is not a number; expected a finite number, or 'missing: [x]'", [&] {
                Frames("files: [{path: b.csv, streams: {y: x}}, {path: a.csv, streams: {x: x}}]\n");
              });
}

// Each table has 300 000 rows. The peak memory may grow by 4 MB.
TEST_F(Tables, MergesLongPipesInConstantMemory) {
  std::vector<std::thread> writers;
  for (const char* name : {"a.csv", "b.csv"}) {
    ASSERT_EQ(mkfifo((folder_ / name).c_str(), 0600), 0);
    writers.emplace_back([path = folder_ / name] {
      std::ofstream out(path);
      out << "t_s,z\n";
      for (int i = 0; i < 300000; ++i) out << i << ",1.234567890\n";
    });
  }
  const auto source = Open(
      "files: [{path: a.csv, streams: {a: {columns: z, delay_s: 20}}}, {path: b.csv, streams: {b: "
      "z}}]\n");
  SourceFrame frame;
  const long before = PeakMemory();
  int measurements = 0;
  Timestamp last = kNoTimestamp;
  while (source->Next(frame)) {
    EXPECT_GT(frame.timestamp, last);
    last = frame.timestamp;
    measurements += static_cast<int>(frame.measurements.size());
  }
  for (std::thread& writer : writers) writer.join();
  EXPECT_EQ(measurements, 600000);
  EXPECT_LT(PeakMemory() - before, 4096);
}

// ---- delays -------------------------------------------------------------------------------------

TEST_F(Tables, ADelayMovesAMeasurementToItsTime) {
  Write("a.csv", "t_s,x,y,z\n1,1,10,5\n1.1,2,20,6\n1.2,3,30,7\n");
  const std::string config =
      "path: a.csv\nstreams: {x: x, y: {columns: y, delay_s: 0.15}}\ntruth: {depth: z}\n";
  // In the order of time.
  EXPECT_EQ(Shown(Frames(config)), (Text{"850 s1=10", "950 s1=20", "1000 s0=1 t0=5", "1050 s1=30",
                                         "1100 s0=2 t0=6", "1200 s0=3 t0=7"}));
  // In the order of arrival.
  any_order_ = true;
  EXPECT_EQ(Shown(Frames(config)), (Text{"850 s1=10", "1000 s0=1 t0=5", "950 s1=20",
                                         "1100 s0=2 t0=6", "1050 s1=30", "1200 s0=3 t0=7"}));
}

TEST_F(Tables, ADelayedRowOfAnotherFileComesFirst) {
  Write("a.csv", "t_s,x\n0,1\n0.1,2\n0.2,3\n");
  Write("b.csv", "t_s,y\n0.25,9\n");
  EXPECT_EQ(Shown(Frames("files: [{path: a.csv, streams: {x: x}}, {path: b.csv, time: {delay_s: "
                         "0.2}, streams: {y: y}}]\n")),
            (Text{"0 s0=1", "50 s1=9", "100 s0=2", "200 s0=3"}));
}

TEST_F(Tables, TheDelayOfATableIsThatOfItsStreams) {
  Write("a.csv", "t_s,x,y\n1,1,2\n");
  EXPECT_EQ(Shown(Frames("path: a.csv\ntime: {column: t_s, delay_s: 0.2}\nstreams: {x: x, y: "
                         "{columns: y, delay_s: 0}}\ntruth: {depth: x}\n")),
            (Text{"800 s0=1", "1000 s1=2 t0=1"}));
  ExpectBadConfig("path: a.csv\nstreams: {x: {columns: x, delay_s: -1}}\n",
                  "run.yaml:2:36 streams.x.delay_s: '-1' is out of range; expected a "
                  "number in [0, 1e+06] (s)");
}

TEST_F(Tables, ADelayedFrameIsCompleteWhenNoEarlierRowCanFollow) {
  ASSERT_EQ(mkfifo(File().c_str(), 0600), 0);
  const int both_ends = open(File().c_str(), O_RDWR);
  const auto write_text = [&](const std::string& text) {
    ASSERT_EQ(write(both_ends, text.data(), text.size()), static_cast<ssize_t>(text.size()));
  };
  write_text("t_s,x,y\n1,1,10\n1.1,2,20\n");
  const auto source = Open("path: a.csv\nstreams: {x: x, y: {columns: y, delay_s: 0.1}}\n");
  SourceFrame frame;
  ASSERT_TRUE(source->Next(frame));  // 0.9 s: the next row is later than 1 s
  EXPECT_EQ(frame.timestamp, 900'000'000);
  ASSERT_TRUE(source->Next(frame));  // 1 s: the row of 1.1 s adds a measurement
  EXPECT_EQ(Held(frame), "0 1 |");
  close(both_ends);
}

// A stream omits rows until the interval has passed since the last row that it used. A row without
// a value does not count, and rows with the same time belong together.
TEST_F(Tables, AStreamMayUseRowsAtAMinimumInterval) {
  Write("a.csv", "t_s,x,y\n0,1,\n0.1,2,20\n0.25,3,30\n0.25,4,40\n0.3,5,50\n0.6,6,60\n");
  const std::string config =
      "path: a.csv\ntime: {column: t_s, repeats: true}\n"
      "streams: {x: {columns: x, min_interval_s: 0.25}, y: {columns: y, min_interval_s: 0.2}}\n";
  const Text expected = {"0 s0=1", "100 s1=20", "250 s0=3 s0=4", "300 s1=50", "600 s0=6 s1=60"};
  EXPECT_EQ(Shown(Frames(config)), expected);
  any_order_ = true;
  EXPECT_EQ(Shown(Frames(config)), expected);
  ExpectBadConfig("path: a.csv\nstreams: {x: {columns: x, min_interval_s: -1}}\n",
                  "run.yaml:2:43 streams.x.min_interval_s: '-1' is out of range; expected a "
                  "number in [0, 1e+09] (s)");
}

TEST_F(Tables, AnOffsetMovesAllTimesOfATable) {
  Write("a.csv", "t,x\n1700000000000000001,1\n");
  EXPECT_EQ(Timestamps(Frames("path: a.csv\ntime: {column: t, unit: ns, offset_s: -1.7e9}\n"
                              "streams: {x: x}\n")),
            std::vector<Timestamp>{1});
  ExpectBadData("t,x\n9e9,1\n",
                "FILE:2:1 t: '9e9' is beyond 292 years; expected -9.2e9 s to 9.2e9 s, or another "
                "unit, such as 'time: {unit: ns}'",
                "path: a.csv\ntime: {column: t, offset_s: 1e9}\nstreams: {x: x}\n");
}

// ---- gaps ---------------------------------------------------------------------------------------

TEST_F(Tables, FilesWhoseTimesDoNotOverlapAreAWarning) {
  const auto warnings = [&] {
    Text texts;
    const LogSubscription log(LogLevel::kWarning,
                              [&](LogLevel, std::string_view text) { texts.emplace_back(text); });
    Frames(
        "files: [{path: a.csv, streams: {x: x}}, {path: b.csv, streams: {y: y}}, "
        "{path: c.csv, time: {unit: ms}, streams: {z: z}}]\n");
    return texts;
  };
  const std::string a = File().string(), b = (folder_ / "b.csv").string(),
                    c = (folder_ / "c.csv").string();
  const std::string expected =
      "; expected times that overlap; check 'time.unit' and 'time.offset_s' of these files";
  Write("a.csv", "t_s,x\n10,1\n100,2\n");
  Write("b.csv", "t_s,y\n20000,1\n90000,2\n");  // in ms
  Write("c.csv", "t_s,z\n11000,1\n");
  EXPECT_EQ(warnings(), Text{b + ":2: the first time is 20000.000000 s, but the times of " + a +
                             ", " + c + " are 10.000000 s to 100.000000 s" + expected});
  Write("b.csv", "t_s,y\n0.1,1\n0.2,2\n");
  Write("a.csv", "t_s,x\n110,1\n200,2\n");
  Write("c.csv", "t_s,z\n120000,1\n");
  EXPECT_EQ(warnings(), Text{a + ":2: the first time is 110.000000 s, but the times of " + b +
                             " are 0.100000 s to 0.200000 s" + expected});
  // There is no warning of a gap that is shorter than a minute or than the rows before it, or that
  // another file spans.
  Write("b.csv", "t_s,y\n55,1\n56,2\n");
  EXPECT_EQ(warnings(), Text{});
  Write("b.csv", "t_s,y\n285,1\n");
  EXPECT_EQ(warnings(), Text{}) << "a begins at 110 s and ends at 200 s";
  Write("b.csv", "t_s,y\n0,1\n1000,2\n");
  EXPECT_EQ(warnings(), Text{});
}

TEST_F(Tables, EpochTimesInTwoFormsAreMerged) {
  Write("a.csv", "t,x\n1403715273262142976,1\n1403715273462142976,2\n");
  Write("b.csv", "t,y\n1403715273.362142976,3\n");
  EXPECT_EQ(
      Timestamps(Frames("files:\n- {path: a.csv, time: {column: t, unit: ns}, streams: {x: "
                        "x}}\n- {path: b.csv, time: {column: t}, streams: {y: y}}\n")),
      (std::vector<Timestamp>{1403715273262142976, 1403715273362142976, 1403715273462142976}));
}

// A unit or an origin is wrong: the files would follow each other.
TEST_F(Tables, FirstTimesMoreThanAYearApartAreAnError) {
  Write("a.csv", "t,x\n1403715273.3,1\n1403715273.4,2\n");
  Write("b.csv", "t,y\n0.1,3\n");
  const std::string config =
      "files:\n- {path: a.csv, time: {column: t}, streams: {x: x}}\n"
      "- {path: b.csv, time: {column: t}, streams: {y: y}}\n";
  for (const bool any_order : {false, true}) {
    any_order_ = any_order;
    ExpectError(ExitCode::kBadData,
                "FILE:2:1 t: '1403715273.3' is more than a year after the first time of " +
                    (folder_ / "b.csv").string() +
                    ", 0.100000 s; expected the same origin of all times: the unit of this column, "
                    "such as 'time: {unit: ns}', or an 'offset_s'",
                [&] { Frames(config); });
  }
  Write("b.csv", "t,y\n1380000000,3\n");
  EXPECT_EQ(Frames(config).size(), 3u) << "less than a year";
}

TEST_F(Tables, ARowTooFarAheadIsAnError) {
  const std::string text = "t_s,x\n0,1\n10,2\n31536000,3\n20,4\n";
  ExpectBadData(text,
                "FILE:4:1 t_s: '31536000' is more than 10.000000 s after line 3; expected a larger "
                "'max_gap_s', or 'on_gap: skip'",
                "path: a.csv\nmax_gap_s: 10\nstreams: {x: x}\n");
  Write(text);
  EXPECT_EQ(Shown(Frames("path: a.csv\nmax_gap_s: 10\non_gap: skip\nstreams: {x: x}\n")),
            (Text{"0 s0=1", "10000 s0=2", "20000 s0=4"}));
  ExpectBadData("t_s,x\n0,1\n10,2\n",
                "FILE:3:1 t_s: '10' is more than 9.900000 s after line 2; expected a larger "
                "'max_gap_s', or 'on_gap: skip'",
                "path: a.csv\nmax_gap_s: 9.9\nstreams: {x: x}\n");
  ExpectBadConfig("path: a.csv\non_gap: skip\nstreams: {x: x}\n",
                  "run.yaml:2:9 on_gap: this key has no effect without 'max_gap_s'; expected the "
                  "key 'max_gap_s', too");
}

TEST_F(Tables, TheLargestStepsDoNotOverflow) {
  Write("t_s,x\n-9.1e9,1\n9.1e9,2\n");
  EXPECT_EQ(Frames("path: a.csv\nstreams: {x: x}\n").size(), 2u);
  EXPECT_EQ(Frames("path: a.csv\nstreams: {x: {columns: x, min_interval_s: 1}}\n").size(), 2u);
  EXPECT_EQ(Frames("path: a.csv\nmax_gap_s: 8e9\non_gap: skip\nstreams: {x: x}\n").size(), 1u);
}

// A clock that was set is not a glitch: the table would be skipped to its end.
TEST_F(Tables, SkippingEndsWhereTheClockHasChanged) {
  std::string text = "t_s,x\n0,1\n";
  for (int i = 0; i < 101; ++i) text += std::to_string(1000 + i) + ",2\n";
  const std::string config = "path: a.csv\nmax_gap_s: 10\non_gap: skip\nstreams: {x: x}\n";
  ExpectBadData(text,
                "FILE:103:1 t_s: '1100' is more than 10.000000 s after line 2, as are the 100 rows "
                "before it; expected a larger 'max_gap_s'",
                config);
  Write(text.substr(0, text.size() - 7));
  EXPECT_EQ(Frames(config).size(), 1u);
}

}  // namespace
}  // namespace alidade::testing
