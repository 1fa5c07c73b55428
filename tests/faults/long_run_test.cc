// SPDX-License-Identifier: Apache-2.0
//
// Tests that the memory of a run does not grow with the length of the run. The configs are those of
// bench/long_run.
#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>
#include <thread>

#include "support/program.h"
#include "support/sanitized.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;
using testing::kSanitized;

const std::string kBench = ALIDADE_SOURCE_DIR "/bench/long_run/";

class LongRun : public testing::ProgramTest {
 protected:
  /// Returns the peak resident memory of a run of `config` in KiB, before it writes its results.
  /// With the page, which contains a bounded number of rows, the peak must not exceed 100 MiB.
  long PeakOf(const std::string& config, testing::Arguments settings) {
    testing::Arguments arguments = {"run", config, "--force", "-o", "out"};
    for (std::string& setting : settings) {
      arguments.insert(arguments.end(), {"--set", std::move(setting)});
    }
    const pid_t pid = Start(arguments);
    const std::string status = "/proc/" + std::to_string(pid) + "/status";
    // The peak memory in rusage includes the memory of this process, so the peak is read from /proc
    // instead.
    long peak = 0, whole = 0;
    siginfo_t ended{};
    while (::waitid(P_PID, static_cast<id_t>(pid), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           ended.si_pid == 0) {
      const std::string text = testing::ReadText(status);
      const std::size_t at = text.find("VmHWM:");
      if (at != std::string::npos) whole = std::stol(text.substr(at + 6));
      const bool is_running =
          Exists("out.partial") && !Exists("out.partial/ekf/final_covariance.csv");
      if (is_running) peak = whole;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    const testing::Outcome outcome = Wait(pid);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_LT(whole, 100 * 1'024);
    return peak;
  }
};

// Tests fault 47 of tests/faults/README.md.
TEST_F(LongRun, MemoryDoesNotGrowWithTheFile) {
  if (kSanitized) GTEST_SKIP() << "the sanitizer does not return freed memory to the heap";
  const std::string file = (folder_ / "tracks.csv").string();
  const auto peak = [&](int frames) {
    std::ofstream rows(file);
    for (int k = 0; k < frames; ++k) {
      for (int i = 0; i < 100; ++i) {
        const int id = i + 100 * ((k + i) / 50);  // each id appears in 50 consecutive frames
        rows << k << ',' << id << ",0," << 6 * i << ".25\n" << k << ',' << id << ",1,20.5\n";
      }
    }
    rows.close();
    return PeakOf(kBench + "stream.yaml", {"source.path=" + file});
  };
  // The files have 3 and 30 MB. If the run stored the additional 900 000 measurements, each of them
  // would take 100 bytes or more.
  const long shorter = peak(1'000), longer = peak(10'000);
  EXPECT_LT(longer - shorter, 2'048) << shorter << " KiB, then " << longer;
  EXPECT_LT(longer, 100 * 1'024);
}

// Tests fault 47 of tests/faults/README.md: the table contains truth, so errors and the lag are
// computed.
TEST_F(LongRun, MemoryDoesNotGrowWithTheTable) {
  if (kSanitized) GTEST_SKIP() << "the sanitizer does not return freed memory to the heap";
  const auto peak = [&](int count) {
    std::ofstream rows(folder_ / "table.csv");
    rows << "t_s,d,depth\n";
    for (int k = 0; k < count; ++k)
      rows << k << ".5," << 80 + k % 7 << ",0." << 320 + k % 10 << '\n';
    rows.close();
    return PeakOf("table.yaml", {"source.truth={depth: depth}"});
  };
  // If the run stored the estimate and the truth of each row, these values would take 16 bytes per
  // row, or 6 MB in total.
  const long shorter = peak(120'000), longer = peak(520'000);
  EXPECT_LT(longer - shorter, 2'048) << shorter << " KiB, then " << longer;
}

// Two pipes are merged by time. ALIDADE_PIPE_GB is the size of their text, by default 0.2 GB.
// PeakOf() expects less than 100 MiB, for any size.
TEST_F(LongRun, GigabytesThroughPipesNeedNoMoreMemory) {
  if (kSanitized) GTEST_SKIP() << "the sanitizer does not return freed memory to the heap";
  const char* const size_gb = std::getenv("ALIDADE_PIPE_GB");
  const double bytes = 1e9 * (size_gb == nullptr ? 0.2 : std::stod(size_gb));
  const std::string ballast(4'000, ';');  // 4001 columns that the config does not name
  const auto rows = static_cast<long>(bytes / 2.0 / static_cast<double>(ballast.size() + 20));
  const auto writer_of = [&](const char* name, const std::string& offset) {
    const fs::path pipe = folder_ / name;
    EXPECT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    return std::thread([=] {
      std::ofstream out(pipe);
      out << "t_s;d" << ballast << '\n';
      for (long k = 0; k < rows; ++k) out << k << offset << 80 + k % 7 << ballast << '\n';
    });
  };
  std::thread first = writer_of("first", ".0;"), second = writer_of("second", ".5;");
  const auto table = [&](const char* name, const char* stream) {
    return std::string("{path: ") + name + ", streams: {" + stream +
           ": {columns: d, delay_s: 20}}}";
  };
  const long peak =
      PeakOf("table.yaml", {"source={type: tables, path: " + folder_.string() + ", files: [" +
                            table("first", "disparity") + ", " + table("second", "other") + "]}"});
  first.join();
  second.join();
  EXPECT_GT(peak, 0);
  EXPECT_EQ(Json("out/run.json").root().At("frames").Number(), 2 * rows);
}

TEST_F(LongRun, MemoryDoesNotGrowAsLandmarksComeAndGo) {
  if (kSanitized) GTEST_SKIP() << "the sanitizer does not return freed memory to the heap";
  const auto peak = [&](int frames) {
    return PeakOf(kBench + "walk.yaml", {"source.max_frames=" + std::to_string(frames),
                                         "source.max_features_per_frame=20"});
  };
  // The path of the scene is generated in advance and takes 104 bytes per frame, or 0.3 MB. If the
  // run stored all landmarks, they would take 12 MB.
  const long shorter = peak(1'000), longer = peak(4'000);
  EXPECT_LT(longer - shorter, 2'048) << shorter << " KiB, then " << longer;
  const Config run = Json("out/run.json");
  const Node counts = run.root().At("estimators").At("ekf").At("counts");
  EXPECT_GT(counts.At("landmarks.deleted").Number(), 50);
}

// A frame is processed when the first row of the next frame arrives, even if no further rows
// follow.
TEST_F(LongRun, APipeIsTakenAsItGrows) {
  ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  const int pipe = ::open((folder_ / "pipe").c_str(), O_RDWR | O_CLOEXEC);
  const auto feed = [&](int frame) {
    const std::string k = std::to_string(frame);
    const std::string rows = k + ",1,0,320\n" + k + ",1,1,240\n";
    ASSERT_EQ(::write(pipe, rows.data(), rows.size()), static_cast<ssize_t>(rows.size()));
  };
  feed(0);
  const pid_t run = Start({"run", kBench + "stream.yaml", "--follow", "-o", "out", "--set",
                           "source.path=" + (folder_ / "pipe").string()});
  constexpr int kFrames = 30;
  for (int k = 1; k <= kFrames; ++k) {
    feed(k);
    ASSERT_TRUE(Eventually([&] {
      const std::string estimates = Read("stdout");
      return std::ranges::count(estimates, '\n') >= k;
    }));
  }
  ::kill(run, SIGINT);
  feed(kFrames + 1);  // a signal that arrives just before the run waits is handled at the next row
  const testing::Outcome stopped = Wait(run);
  EXPECT_EQ(stopped.code, 75) << stopped.err;
  EXPECT_GE(Json("out/run.json").root().At("frames").Number(), kFrames);
  ::close(pipe);
}

}  // namespace
}  // namespace alidade
