// SPDX-License-Identifier: Apache-2.0
//
// Tests how tracks are read: representations, times, the files next to the tracks, pipes and real
// data.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <thread>

#include "support/peak_memory.h"
#include "tracks_fixture.h"

namespace alidade::testing {
namespace {

using Values = std::vector<double>;

TEST_F(TracksTest, ReadsTheRowsOfAFrameInAnyOrder) {
  const auto frames = FramesOf(
      "frame,feature,dim,value\n# c\n0,7,1,20\n0,3,0,1\n0,7,0,10\n"
      "0,3,1,2\n\n2,3,0,1.5\n2,3,1,2.5\n");
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[0].timestamp, 0);
  EXPECT_EQ(frames[1].timestamp, 200'000'000);  // frame 2 at 10 Hz
  ASSERT_EQ(frames[0].measurements.size(), 2u);
  EXPECT_EQ(frames[0].measurements[0].landmark, 3);
  EXPECT_EQ(frames[0].measurements[0].values, (Values{1, 2}));
  EXPECT_EQ(frames[0].measurements[1].landmark, 7);
  EXPECT_EQ(frames[0].measurements[1].values, (Values{10, 20}));
  EXPECT_EQ(frames[1].measurements.at(0).timestamp, frames[1].timestamp);
}

TEST_F(TracksTest, AHeaderAndByteOrderMarkAndCrLfMakeNoDifference) {
  for (const std::string text : {"0,3,0,1\n0,3,1,2\n",
                                 "\xEF\xBB\xBF"
                                 "0,3,0,1\r\n0,3,1,2\r\n",
                                 "frame, feature, dim, value\n0, 3, 0, 1\n0,3,1,2"}) {
    const auto frames = FramesOf(text);
    ASSERT_EQ(frames.size(), 1u) << text;
    EXPECT_EQ(frames[0].measurements.at(0).values, (Values{1, 2}));
  }
}

TEST_F(TracksTest, MeasuresWhatTheConfigSays) {
  Write("tracks.csv", "0,1,0,10\n0,1,1,11\n0,1,2,12\n0,1,3,13\n0,2,0,20\n0,2,1,21\n");
  const auto values = [&](const std::string& measures) {
    std::vector<Values> all;
    const auto frames = Frames("rate_hz: 10, measures: " + measures);
    for (const Measurement& m : frames.at(0).measurements) {
      all.push_back(m.values);
    }
    return all;
  };
  EXPECT_EQ(values("pixel"), (std::vector<Values>{{10, 11}, {20, 21}}));
  EXPECT_EQ(values("stereo"), (std::vector<Values>{{10, 11, 12, 13}}));
  EXPECT_EQ(values("depth"), (std::vector<Values>{{10, 11, 12}}));
  EXPECT_EQ(Open("rate_hz: 10, measures: stereo")->streams()[0].size, 4);
}

TEST_F(TracksTest, MayBeginLaterAndWithoutTheFeaturesOfBefore) {
  Write("tracks.csv",
        "0,1,0,1\n0,1,1,1\n1,1,0,2\n1,1,1,2\n1,2,0,3\n1,2,1,3\n2,1,0,4\n2,1,1,4\n2,2,0,5\n2,2,1,5\n"
        "3,3,0,6\n3,3,1,6\n");
  const auto ids = [&](const std::string& keys) {
    std::vector<std::pair<Timestamp, std::vector<std::int64_t>>> all;
    for (const SourceFrame& frame : Frames("rate_hz: 10" + keys)) {
      all.emplace_back(frame.timestamp / 100'000'000, std::vector<std::int64_t>());
      for (const Measurement& m : frame.measurements) all.back().second.push_back(m.landmark);
    }
    return all;
  };
  using Ids = decltype(ids(""));
  EXPECT_EQ(ids(", start_frame: 2"), (Ids{{2, {1, 2}}, {3, {3}}}));
  EXPECT_EQ(ids(", features_from: 1"), (Ids{{0, {}}, {1, {2}}, {2, {2}}, {3, {3}}}));
  EXPECT_EQ(ids(", start_frame: 1, features_from: 2, max_frames: 2"), (Ids{{1, {}}, {2, {}}}));
  ExpectError(
      ExitCode::kBadData,
      "DIR/tracks.csv:12: the last frame is 3, before start_frame 4; expected start_frame at "
      "most 3",
      [&] { ids(", start_frame: 4"); });
}

// The camera of frame 1 is at (1, 2, 3), rotated by 90 degrees about z. The x axis of the camera is
// then the y axis of the file's world.
TEST_F(TracksTest, TheWorldMayBeTheFirstCamera) {
  Write("tracks.csv", "0,1,0,1\n0,1,1,1\n1,1,0,2\n1,1,1,2\n2,1,0,4\n2,1,1,4\n");
  Write("truth.tum", "0.1 1 2 3 0 0 0.7071067811865476 0.7071067811865476\n0.2 1 7 3.5 0 0 1 0\n");
  const auto frames = Frames("rate_hz: 10, start_frame: 1, world: first_camera");
  ASSERT_EQ(frames.size(), 2u);
  const Values position{5, 0, 0.5}, turned{std::sqrt(0.5), 0, 0, std::sqrt(0.5)}, none{1, 0, 0, 0};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(frames[0].truth[0][i], 0.0, 1e-15);
    EXPECT_NEAR(frames[1].truth[0][i], position[i], 1e-14);
  }
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(frames[0].truth[1][i], none[i], 1e-15);
    EXPECT_NEAR(frames[1].truth[1][i], turned[i], 1e-15);
  }
  ExpectError(ExitCode::kBadData,
              "DIR/tracks.csv:3: frame 0 has no true pose, but its camera defines the world; "
              "expected a true pose within truth_tolerance_s, or world: file",
              [&] { Frames("rate_hz: 10, world: first_camera"); });
}

TEST_F(TracksTest, TimestampsSayWhatFramesThereAre) {
  Write("tracks.csv", "1,3,0,1\n1,3,1,2\n");
  Write("timestamps.csv", "frame,t_s\n0,0.5\n1,0.6000000001\n2,0.7\n");
  const auto frames = Frames("measures: pixel");
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_TRUE(frames[0].measurements.empty());
  EXPECT_EQ(frames[1].measurements.size(), 1u);
  EXPECT_TRUE(frames[2].measurements.empty());
  EXPECT_EQ(frames[1].timestamp, 600'000'000);
  EXPECT_EQ(Frames("max_frames: 2").size(), 2u);
  EXPECT_EQ(Frames("max_frames: 2", ".").size(), 2u) << "the path of a folder means its tracks.csv";
  EXPECT_EQ(Frames("rate_hz: 4")[0].timestamp, 250'000'000)
      << "rate_hz has priority over timestamps.csv";
}

TEST_F(TracksTest, OdometryIsHeldOrTheMeanOfAStep) {
  Write("tracks.csv", "0,3,0,1\n0,3,1,2\n");
  Write("timestamps.csv", "0,0\n1,1\n2,2\n3,3\n");
  Write("odometry.csv",
        "frame,wx_rad_s,wy_rad_s,wz_rad_s,vx_m_s,vy_m_s,vz_m_s,note\n"
        "0,1,2,3,4,5,6,0\n1,3,4,5,6,7,8,0\n3,9,9,9,9,9,9,0\n");
  const auto odometry = [&](const std::string& keys) {
    std::vector<Values> all;
    for (const SourceFrame& frame : Frames(keys)) {
      const bool has = !frame.measurements.empty() && frame.measurements.back().stream == 1;
      all.push_back(has ? frame.measurements.back().values : Values{});
    }
    return all;
  };
  const Values none, last(6, 9.0);
  EXPECT_EQ(odometry("measures: pixel"),
            (std::vector<Values>{{4, 5, 6, 1, 2, 3}, {6, 7, 8, 3, 4, 5}, none, last}));
  EXPECT_EQ(odometry("odometry: mean"),
            (std::vector<Values>{{5, 6, 7, 2, 3, 4}, {7.5, 8, 8.5, 6, 6.5, 7}, none, last}));
  EXPECT_EQ(Open("odometry: none")->streams().size(), 1u);
}

TEST_F(TracksTest, TruthIsTakenAtTheTimeOfAFrame) {
  Write("tracks.csv", "0,3,0,1\n0,3,1,2\n");
  Write("timestamps.csv", "0,0\n1,1\n2,2\n");
  Write("groundtruth.tum",
        "# t x y z qx qy qz qw\n-1 9 9 9 0 0 0 1\n0.0005 1 2 3  0.5 0.5 0.5 0.5005\n"
        "1.002 4 5 6 0 0 0 1\n2 7 8 9 0 0 0 -1\n");
  const auto source = Open("state_entry: robot");
  ASSERT_EQ(source->truths().size(), 2u);
  EXPECT_EQ(source->truths()[0].name, "robot.position");
  EXPECT_EQ(source->truths()[1].name, "robot.orientation");
  const auto frames = Frames("state_entry: robot");
  EXPECT_EQ(frames[0].truth.at(0), (Values{1, 2, 3}));
  EXPECT_EQ(frames[0].truth[1], (Values{0.5005, 0.5, 0.5, 0.5})) << "w is the first element";
  EXPECT_TRUE(frames[1].truth[0].empty()) << "the true pose is 2 ms away";
  EXPECT_EQ(frames[2].truth[0], (Values{7, 8, 9}));
  EXPECT_EQ(Frames("truth_tolerance_s: 0.002")[1].truth[0], (Values{4, 5, 6}));
}

TEST_F(TracksTest, TruthIsThePoseNearestInTime) {
  Write("tracks.csv", "0,3,0,1\n0,3,1,2\n1,3,0,1\n1,3,1,2\n2,3,0,1\n2,3,1,2\n");
  Write("truth.tum",
        "-0.02 1 0 0 0 0 0 1\n0.01 2 0 0 0 0 0 1\n0.08 3 0 0 0 0 0 1\n0.1 4 0 0 0 0 0 1\n"
        "0.11 5 0 0 0 0 0 1\n0.17 6 0 0 0 0 0 1\n");
  const std::vector<SourceFrame> frames = Frames("rate_hz: 10, truth_tolerance_s: 0.03");
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames[0].truth[0].at(0), 2.0);
  EXPECT_EQ(frames[1].truth[0].at(0), 4.0);
  EXPECT_EQ(frames[2].truth[0].at(0), 6.0);
}

TEST_F(TracksTest, ReadsAPipeAsItIsWritten) {
  ASSERT_EQ(mkfifo(File().c_str(), 0600), 0);
  int descriptor = -1;
  std::thread writer([&] {
    descriptor = open(File().c_str(), O_WRONLY);
    EXPECT_EQ(write(descriptor, "0,3,0,1\n0,3,1,2\n1,3,0,5\n", 24), 24);
  });
  const auto source = Open();
  SourceFrame frame;
  EXPECT_TRUE(source->Next(frame));  // Next() returns although the pipe is still open
  EXPECT_EQ(frame.measurements.at(0).values, (Values{1, 2}));
  writer.join();
  EXPECT_EQ(write(descriptor, "1,3,1,6\n", 8), 8);
  close(descriptor);
  EXPECT_TRUE(source->Next(frame));
  EXPECT_EQ(frame.measurements.at(0).values, (Values{5, 6}));
  EXPECT_FALSE(source->Next(frame));
}

// Tests fault 47 of tests/faults/README.md.
TEST_F(TracksTest, StreamsALongFileInConstantMemory) {
  // A thread writes 2e6 rows, about 30 MB, to a pipe. The peak memory may grow by 4 MB.
  ASSERT_EQ(mkfifo(File().c_str(), 0600), 0);
  std::thread writer([&] {
    std::ofstream out(File());
    for (int frame = 0; frame < 10000; ++frame) {
      for (int i = 0; i < 200; ++i) {
        out << frame << ',' << i / 2 << ',' << i % 2 << ",123.456\n";
      }
    }
  });
  const auto source = Open();
  SourceFrame frame;
  const long before = PeakMemory();
  std::size_t count = 0;
  while (source->Next(frame)) count += frame.measurements.size();
  writer.join();
  EXPECT_EQ(count, 1000000u);
  EXPECT_LT(PeakMemory() - before, 4096);
}

TEST_F(TracksTest, ReadsRealTracks) {
  const char* const data = std::getenv("ALIDADE_DATA");
  if (data == nullptr) GTEST_SKIP() << "ALIDADE_DATA is not set";
  const std::string drive = std::string(data) + "/kitti-stereo-tracks/drive_0001";
  if (!fs::exists(drive)) GTEST_SKIP() << drive << " does not exist";
  const auto frames = Frames("measures: stereo, odometry: mean", drive);
  ASSERT_EQ(frames.size(), 108u);
  std::size_t observations = 0;
  for (const SourceFrame& frame : frames) {
    EXPECT_EQ(frame.truth.at(0).size(), 3u);
    for (const Measurement& m : frame.measurements) observations += m.stream == 0;
  }
  EXPECT_EQ(observations, (42005u - 1) / 4);  // four rows below the header for each observation
  EXPECT_EQ(frames[0].measurements[0].values[0], 343.4486);
  const Measurement& odometry = frames[0].measurements.back();
  EXPECT_NEAR(odometry.values[0], 0.5 * (13.172717 + 13.129880), 1e-12);
  EXPECT_NEAR(odometry.values[3], 0.5 * (0.008902 + 0.004393), 1e-12);
}

}  // namespace
}  // namespace alidade::testing
