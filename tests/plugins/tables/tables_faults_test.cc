// SPDX-License-Identifier: Apache-2.0
//
// Tests tables and configs with a fault. The comment above a test contains the number of the fault.
#include <algorithm>

#include "tables_fixture.h"

namespace alidade::testing {
namespace {

// ---- bad data -----------------------------------------------------------------------------------

// Tests fault 27 of tests/faults/README.md.
TEST_F(Tables, WrongNumberOfColumns) {
  ExpectBadData(std::string("# c\n") + kHeader + "0,1,2,3\n1,2,3\n",
                "FILE:4:6: the line has 3 columns; expected 4 columns, as in line 2");
  ExpectBadData(std::string(kHeader) + "0,1,2,3,4\n",
                "FILE:2:9: the line has 5 columns; expected 4 columns, as in line 1");
}

TEST_F(Tables, BytesThatAreNoText) {
  const std::string expected =
      "FILE:1:1: this is not a text file; expected a table as text; to read a compressed table, "
      "use a pipe: zcat FILE | alidade run CONFIG --set source.path=-";
  ExpectBadData("\x1F\x8B\x08\x01,t_s\n", expected);
  ExpectBadData(std::string("t\0_\0s\0\n", 7), expected);
}

// Tests fault 34 of tests/faults/README.md.
TEST_F(Tables, TruncatedLastLine) {
  ExpectBadData(
      std::string(kHeader) + "0,1,2,3\n1,2",
      "FILE:3:4: the last line is cut short: it has 2 columns; expected 4 columns, as in line 1");
}

// Tests fault 28 of tests/faults/README.md.
TEST_F(Tables, NotANumber) {
  const auto expect = [&](const std::string& cell, const std::string& hint) {
    ExpectBadData(
        std::string(kHeader) + "0, " + cell + ",2,3\n",
        "FILE:2:3 disparity_px: '" + cell + "' is not a number; expected a finite number" + hint);
  };
  // A word may mark a missing value. A cell with a digit cannot.
  expect("abc", ", or 'missing: [abc]'");
  expect("+", ", or 'missing: [\"+\"]'");
  for (const char* cell : {"6.5x", "0x10", "1.5.2", "+-1", "--1", "1e", "1 2"}) expect(cell, "");
}

TEST_F(Tables, ShowsHostileCellsHarmlessly) {
  ExpectBadData(std::string(kHeader) + "0,\x1b[31m" + std::string(50, 'y') + ",2,3\n",
                "FILE:2:3 disparity_px: '?[31m" + std::string(35, 'y') +
                    "...' is not a number; expected a finite number");
  ExpectBadData(std::string(kHeader) + "0," + std::string(1, '\0') + ",2,3\n",
                "FILE:2:3 disparity_px: '?' is not a number; expected a finite number, or "
                "'missing: [\"?\"]'");
}

// Tests fault 29 of tests/faults/README.md.
TEST_F(Tables, NotFinite) {
  for (const std::string cell : {"nan", "inf", "-inf", "NaN", "Infinity"}) {
    ExpectBadData(std::string(kHeader) + "0,1," + cell + ",3\n",
                  "FILE:2:5 scale: '" + cell +
                      "' is not finite; expected a finite number, or 'missing: [" +
                      (cell == "-inf" ? "\"-inf\"" : cell) + "]'");
  }
  ExpectBadData(std::string(kHeader) + "nan,1,2,3\n",
                "FILE:2:1 t_s: 'nan' is not finite; expected a finite number");
}

// Tests fault 30 of tests/faults/README.md.
TEST_F(Tables, Overflow) {
  for (const std::string cell : {"1e400", "-1e400", "1e-400"}) {
    ExpectBadData(std::string(kHeader) + "0,1,2," + cell + "\n",
                  "FILE:2:7 reference_depth_m: '" + cell +
                      "' is too large or too small; expected a finite number");
  }
}

TEST_F(Tables, ReciprocalOfZero) {
  ExpectBadData(std::string(kHeader) + "0,1,0,3\n",
                "FILE:2:5 scale: '0' has no finite reciprocal; expected a finite number");
}

// Tests fault 33 of tests/faults/README.md.
TEST_F(Tables, LineTooLong) {
  // A row has three cells and a long number. A row of 4096 bytes is accepted, and a longer row is
  // an error. The line end does not count.
  const auto row = [](std::size_t length) { return "0,1,2,3." + std::string(length - 8, '0'); };
  for (const std::string end : {"", "\n", "\r\n"}) {
    EXPECT_EQ(Frames(kHeader + row(4096) + end, kDepthConfig).size(), 1u);
    ExpectBadData(kHeader + row(4097) + end,
                  "FILE:2:1: the line is too long; expected at most 4096 bytes per line");
  }
  ExpectBadData(kHeader + row(200000),
                "FILE:2:1: the line is too long; expected at most 4096 bytes per line");
}

TEST_F(Tables, LongestLineMayEndAcrossTheBuffer) {
  // The buffer of 65536 bytes ends between the '\r' and the '
  // ' of a line of 4096 bytes. The two characters count as one line end, so the next line has the
  // correct number.
  std::string text = kHeader;
  while (text.size() + 4097 + 4000 < 65536) text += '#' + std::string(3998, ' ') + '\n';
  text += '#' + std::string(65536 - 4097 - 2 - text.size(), ' ') + '\n';
  const auto before = std::count(text.begin(), text.end(), '\n');
  text += "0,1,2,3." + std::string(4088, '0') + "\r\nx,1,2,3\n";
  ExpectBadData(text, "FILE:" + std::to_string(before + 2) +
                          ":1 t_s: 'x' is not a number; expected a finite number");
}

// Tests faults 35 and 36 of tests/faults/README.md.
TEST_F(Tables, TimeMustIncrease) {
  ExpectBadData(std::string(kHeader) + "0,1,2,3\n0.2,1,2,3\n# c\n0.1,1,2,3\n",
                "FILE:5:1 t_s: '0.1' is earlier than in line 3; expected increasing times, or "
                "'out_of_sequence.policy: buffer' or 'rollback'");
  ExpectBadData(
      std::string(kHeader) + "0,1,2,3\n0.2,1,2,3\n0.2000000001,1,2,3\n",
      "FILE:4:1 t_s: '0.2000000001' is the same time as in line 3; expected increasing times, "
      "or 'time.repeats: true', which joins rows of one time into a frame, or "
      "'out_of_sequence.policy: buffer', which joins rows of different streams");
}

TEST_F(Tables, TimeBeyondTheTimestamps) {
  ExpectBadData(std::string(kHeader) + "9.3e9,1,2,3\n",
                "FILE:2:1 t_s: '9.3e9' is beyond 292 years; expected -9.2e9 s to 9.2e9 s, or "
                "another unit, such as 'time: {unit: ns}'");
  ExpectBadData(std::string(kHeader) + ",1,2,3\n",
                "FILE:2:1 t_s: '' is an empty cell; expected a finite number");
}

// Tests fault 43 of tests/faults/README.md.
TEST_F(Tables, NothingAtAll) {
  ExpectBadData("", "FILE: the header line is missing; expected a line that names the columns");
  ExpectBadData("# c\n\n",
                "FILE: the header line is missing; expected a line that names the columns");
  ExpectBadData(kHeader, "FILE: the table has no rows; expected a row below the header");
}

// ---- bad config ---------------------------------------------------------------------------------

TEST_F(Tables, UnknownColumn) {
  Write(std::string(kHeader) + "0,1,2,3\n");
  ExpectBadConfig("path: a.csv\nstreams: {d: [disparity_pc]}\n",
                  "run.yaml:2:15 streams.d[0]: there is no column 'disparity_pc' in FILE; expected "
                  "one of t_s, disparity_px, scale, reference_depth_m; did you mean "
                  "'disparity_px'?");
  ExpectBadConfig("path: a.csv\nstreams: {d: scale}\ntime: {column: timestamp}\n",
                  "run.yaml:3:16 time.column: there is no column 'timestamp' in FILE; expected one "
                  "of t_s, disparity_px, scale, reference_depth_m");
}

TEST_F(Tables, MissingIsTheTextOfACell) {
  Write("t_s,z\n0,1\n");
  ExpectBadConfig("path: a.csv\nmissing: .nan\nstreams: {z: z}\n",
                  "run.yaml:2:10 missing: '.nan' cannot be the text of a cell; expected the text "
                  "that the table contains; did you mean 'nan'?");
}

TEST_F(Tables, ShowsHostileColumnNamesHarmlessly) {
  Write("t_s,disp\x1b[31marity," + std::string(50, 'y') + "\n0,1,2\n");
  ExpectBadConfig("path: a.csv\nstreams: {d: 'disp[31marity'}\n",
                  "run.yaml:2:14 streams.d: there is no column 'disp[31marity' in FILE; expected "
                  "one of t_s, disp?[31marity, " +
                      std::string(40, 'y') + "...; did you mean 'disp?[31marity'?");
}

TEST_F(Tables, ColumnNamedTwice) {
  Write("t_s,z,z\n0,1,2\n");
  ExpectBadConfig("path: a.csv\nstreams: {z: z}\n",
                  "run.yaml:2:14 streams.z: FILE has two columns 'z'; expected one column with "
                  "this name");
}

TEST_F(Tables, UnknownAndMissingKeys) {
  Write(std::string(kHeader) + "0,1,2,3\n");
  ExpectBadConfig("path: a.csv\nstreams: {d: {columns: scale, recipocal: true}}\n",
                  "run.yaml:2:31 streams.d.recipocal: unknown key; did you mean 'reciprocal'?");
  ExpectBadConfig("path: a.csv\nstreams: {d: scale}\nblind_afer: 0.5\n",
                  "run.yaml:3:1 blind_afer: unknown key; did you mean 'blind_after'?");
  ExpectBadConfig("path: a.csv\nstreams: {}\n",
                  "run.yaml:2:10 streams: the map is empty; expected a map such as 'disparity: "
                  "disparity_px'");
  ExpectBadConfig("streams: {d: scale}\n", "run.yaml:1:1 path: missing key, needed by tables");
}

TEST_F(Tables, GainOfNothing) {
  Write("t_s,z\n0,1\n");
  ExpectBadConfig("path: a.csv\nstreams: {z: {columns: z, gain: 0}}\n",
                  "run.yaml:2:33 streams.z.gain: a gain of 0 sets all values to 0; expected a "
                  "number other than 0");
}

TEST_F(Tables, TimeAndRateExcludeEachOther) {
  ExpectBadConfig("path: a.csv\ntime: {column: t_s}\nrate_hz: 30\nstreams: {d: scale}\n",
                  "run.yaml:3:10 rate_hz: 'time' and 'rate_hz' are both given; expected only "
                  "one of these keys");
  ExpectBadConfig("path: a.csv\nmax_gap_s: 1\nrate_hz: 30\nstreams: {d: scale}\n",
                  "run.yaml:3:10 rate_hz: 'max_gap_s' and 'rate_hz' are both given; expected only "
                  "one of these keys");
}

}  // namespace
}  // namespace alidade::testing
