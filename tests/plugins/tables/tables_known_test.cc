// SPDX-License-Identifier: Apache-2.0
// Known numbers that a stream reads from another table by id.

#include "tables_fixture.h"

namespace alidade::testing {
namespace {

constexpr const char* kConfig =
    "path: a.csv\n"
    "streams: {range: {columns: r, known: {path: beacons.csv, id: beacon, columns: [x, y]}}, "
    "other: r}\n";
constexpr const char* kBeacons = "name,beacon,y,x\nnear,1,10,11\nfar,A7,20,21\n";

class KnownTables : public Tables {
 protected:
  /// Returns `message` after the path of the table of beacons.
  std::string InBeacons(const std::string& message) const {
    return (folder_ / "beacons.csv").string() + message;
  }
};

TEST_F(KnownTables, AReadingHasTheNumbersOfItsId) {
  Write("beacons.csv", kBeacons);
  Write("t_s,beacon,r\n0,A7,5\n1, 1.0,6\n2,,7\n");
  const auto source = Open(kConfig);
  EXPECT_EQ(source->streams()[0].size, 1);
  EXPECT_EQ(source->streams()[0].known, 2);
  EXPECT_EQ(source->streams()[1].known, 0);
  const auto frames = Frames(kConfig);
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames[0].measurements[0].values, std::vector<double>{5.0});
  EXPECT_EQ(frames[0].measurements[0].known, (std::vector<double>{21.0, 20.0}));
  EXPECT_TRUE(frames[0].measurements[1].known.empty());
  EXPECT_EQ(frames[1].measurements[0].known, (std::vector<double>{11.0, 10.0}))
      << "1 and 1.0 are the same number";
  EXPECT_EQ(Held(frames[2]), "1 |") << "a reading without id has no known numbers";
}

TEST_F(KnownTables, TheTableIsInTheFolderOfTheFiles) {
  fs::create_directory(folder_ / "log");
  Write("log/beacons.csv", kBeacons);
  Write("log/a.csv", "t_s,beacon,r\n0,1,5\n");
  const auto frames = Frames(
      "path: log\nfiles: [{path: a.csv, streams: {range: {columns: r, known: {path: beacons.csv, "
      "id: beacon, columns: x}}}}]\n");
  EXPECT_EQ(frames[0].measurements[0].known, std::vector<double>{11.0});
}

TEST_F(KnownTables, AnIdThatTheTableLacks) {
  Write("beacons.csv", kBeacons);
  ExpectBadData("t_s,beacon,r\n0,1,5\n1,2,6\n",
                "FILE:3:3 beacon: '2' is not an id in " +
                    InBeacons("; expected a row with this id in that table, or readings selected "
                              "by 'rows: {beacon: [..]}'"),
                kConfig);
}

TEST_F(KnownTables, RowsSelectTheReadingsThatNeedAnId) {
  Write("beacons.csv", kBeacons);
  const auto frames = Frames(
      "t_s,beacon,r\n0,2,5\n1,1,6\n",
      "path: a.csv\nstreams: {range: {columns: r, rows: {beacon: 1}, known: {path: beacons.csv, "
      "id: beacon, columns: x}}}\n");
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].measurements[0].known, std::vector<double>{11.0});
}

TEST_F(KnownTables, AStarStandsForEachId) {
  Write("beacons.csv", kBeacons);
  Write("t_s,beacon,r\n0,A7,5\n1, 1.0,6\n2,,7\n3,1,8\n");
  const std::string config =
      "path: a.csv\nstreams: {range_*_m: {columns: r, known: {path: beacons.csv, id: beacon, "
      "columns: [x, y]}}, other: r}\n";
  const auto source = Open(config);
  ASSERT_EQ(source->streams().size(), 3u);
  EXPECT_EQ(source->streams()[0].name, "range_1_m");
  EXPECT_EQ(source->streams()[1].name, "range_A7_m");
  EXPECT_EQ(source->streams()[1].known, 2);
  EXPECT_EQ(source->streams()[2].name, "other");
  const auto frames = Frames(config);
  EXPECT_EQ(Shown(frames), (std::vector<std::string>{"0 s1=5 s2=5", "1000 s0=6 s2=6", "2000 s2=7",
                                                     "3000 s0=8 s2=8"}));
  EXPECT_EQ(frames[0].measurements[0].known, (std::vector<double>{21.0, 20.0}));
  EXPECT_EQ(frames[3].measurements[0].known, (std::vector<double>{11.0, 10.0}));
  ExpectBadData("t_s,beacon,r\n0,1,5\n1,2,6\n",
                "FILE:3:3 beacon: '2' is not an id in " +
                    InBeacons("; expected a row with this id in that table, or readings selected "
                              "by 'rows: {beacon: [..]}'"),
                config);
}

TEST_F(KnownTables, AStarNeedsATableOfKnownNumbers) {
  Write("t_s,r\n0,5\n");
  ExpectBadConfig("path: a.csv\nstreams: {range_*: r}\n",
                  "run.yaml:2:20 streams.range_*: the name contains `*`, which stands for the ids "
                  "of a table of known numbers; expected known: {path: beacons.csv, id: beacon, "
                  "columns: [x, y]}, or a name without `*`");
}

TEST_F(KnownTables, AnIdTwice) {
  Write("beacons.csv", "beacon,x,y\n1,2,3\n4,5,6\n1.0,7,8\n");
  ExpectBadData("t_s,beacon,r\n0,1,5\n",
                InBeacons(":4:1 beacon: '1.0' is also the id of line 2; expected one row for each "
                          "id"),
                kConfig);
}

TEST_F(KnownTables, ANumberIsMissing) {
  Write("beacons.csv", "beacon,x,y\n1,2,\n");
  ExpectBadData("t_s,beacon,r\n0,1,5\n",
                InBeacons(":2:5 y: '' is an empty cell; expected a finite number"), kConfig);
}

TEST_F(KnownTables, MissingColumns) {
  Write("t_s,beacon,r\n0,1,5\n");
  Write("beacons.csv", "beacon,x_m,y\n1,2,3\n");
  ExpectBadConfig(kConfig,
                  "run.yaml:2:80 streams.range.known.columns[0]: there is no column 'x' in " +
                      InBeacons("; expected one of beacon, x_m, y; did you mean 'y'?"));
  Write("beacons.csv", "id,x,y\n1,2,3\n");
  ExpectBadConfig(kConfig, "run.yaml:2:62 streams.range.known.id: there is no column 'beacon' in " +
                               InBeacons("; expected one of id, x, y"));
  Write("beacons.csv", kBeacons);
  Write("t_s,id,r\n0,1,5\n");
  ExpectBadConfig(kConfig,
                  "run.yaml:2:62 streams.range.known.id: there is no column 'beacon' in FILE; "
                  "expected one of t_s, id, r");
}

TEST_F(KnownTables, MissingKeysAndFile) {
  Write("t_s,beacon,r\n0,1,5\n");
  ExpectBadConfig("path: a.csv\nstreams: {z: {columns: r, known: {path: b.csv, columns: x}}}\n",
                  "run.yaml:2:27 streams.z.known.id: missing key, needed by known; expected the "
                  "column of the ids, in both tables");
  ExpectBadConfig(
      "path: a.csv\nstreams: {z: {columns: r, known: {path: b.csv, id: i, columns: x, y: 1}}}\n",
      "run.yaml:2:67 streams.z.known.y: unknown key; expected one of columns, id, path");
  ExpectError(ExitCode::kInputMissing,
              "run.yaml:2:45 streams.range.known.path: cannot read '" +
                  InBeacons("': No such file or directory; expected a readable file"),
              [&] { Frames(kConfig); });
}

}  // namespace
}  // namespace alidade::testing
