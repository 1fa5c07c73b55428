// SPDX-License-Identifier: Apache-2.0
#include "plugins/csv/csv.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <clocale>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <thread>

namespace alidade {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDepthConfig =
    "path: a.csv\nstreams: {disparity: disparity_px, inverse_scale: {columns: [scale], "
    "reciprocal: true}}\ntruth: {depth: reference_depth_m}\n";
constexpr const char* kHeader = "t_s,disparity_px,scale,reference_depth_m\n";

/// A folder of its own for each test, with `a.csv` in it.
class Csv : public ::testing::Test {
 protected:
  Csv() {
    std::string name = (fs::temp_directory_path() / "alidade_csv_XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~Csv() override { fs::remove_all(folder_); }

  fs::path File() const { return folder_ / "a.csv"; }
  void Write(const std::string& text) const { std::ofstream(File(), std::ios::binary) << text; }

  /// The source of `config_`, whose `source` map is the root.
  std::unique_ptr<CsvSource> Open(const std::string& config = kDepthConfig) {
    config_ = std::make_unique<Config>(Config::FromText(config, "run.yaml"));
    return OpenConfig();
  }
  std::unique_ptr<CsvSource> OpenConfig() {
    static const AlidadeHost kHost{};
    Params params(&kHost);
    auto source = std::make_unique<CsvSource>(SourceArguments{config_->root(), params, 1, folder_});
    config_->root().RejectUnread();
    return source;
  }
  std::vector<Frame> Frames(const std::string& config = kDepthConfig) {
    const auto source = Open(config);
    std::vector<Frame> frames;
    for (Frame frame; source->Next(frame);) frames.push_back(frame);
    return frames;
  }
  std::vector<Frame> Frames(const std::string& text, const std::string& config) {
    Write(text);
    return Frames(config);
  }

  /// That the work fails with `code` and exactly `message`, where FILE stands for a.csv.
  void ExpectError(ExitCode code, std::string message, const std::function<void()>& work) const {
    if (const auto at = message.find("FILE"); at != std::string::npos) {
      message.replace(at, 4, File().string());
    }
    try {
      work();
      FAIL() << "no error; expected: " << message;
    } catch (const Error& error) {
      EXPECT_EQ(error.what(), message);
      EXPECT_EQ(error.code(), code);
    }
  }
  void ExpectBadData(const std::string& text, const std::string& message,
                     const std::string& config = kDepthConfig) {
    Write(text);
    ExpectError(ExitCode::kBadData, message, [&] { Frames(config); });
  }
  void ExpectBadConfig(const std::string& config, const std::string& message) {
    ExpectError(ExitCode::kBadConfig, message, [&] { Frames(config); });
  }

  fs::path folder_;
  std::unique_ptr<Config> config_;
};

std::vector<Stamp> Stamps(const std::vector<Frame>& frames) {
  std::vector<Stamp> stamps;
  for (const Frame& frame : frames) stamps.push_back(frame.stamp);
  return stamps;
}

/// For each frame the names of what it holds, as `0 1 | 1`: streams and known truth values.
std::string Held(const Frame& frame) {
  std::string held;
  for (const Measurement& m : frame.measurements) held += std::to_string(m.stream) + ' ';
  held += "|";
  for (std::size_t i = 0; i < frame.truth.size(); ++i) {
    if (!frame.truth[i].empty()) held += ' ' + std::to_string(i);
  }
  return held;
}

// ---- what is read -------------------------------------------------------------------------------

TEST_F(Csv, ReadsNamedColumns) {
  const auto frames =
      Frames(std::string(kHeader) + "0,6.5,1.0,58\n0.103007,6.75,1.25,57\n", kDepthConfig);
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(Stamps(frames), (std::vector<Stamp>{0, 103'007'000}));
  ASSERT_EQ(Held(frames[1]), "0 1 | 0");
  EXPECT_EQ(frames[1].measurements[0].values, std::vector<double>{6.75});
  EXPECT_EQ(frames[1].measurements[1].values, std::vector<double>{1.0 / 1.25});
  EXPECT_EQ(frames[1].measurements[1].stamp, 103'007'000);
  EXPECT_EQ(frames[1].measurements[1].landmark, -1);
  EXPECT_EQ(frames[1].truth[0], std::vector<double>{57.0});
}

TEST_F(Csv, GivesStreamsAndTruthsInTheOrderWritten) {
  Write("t_s,u,v,d\n0,1,2,3\n");
  const auto source = Open("path: a.csv\nstreams: {pixel: [v, u], disparity: d}\n");
  ASSERT_EQ(source->streams().size(), 2u);
  EXPECT_EQ(source->streams()[0].name, "pixel");
  EXPECT_EQ(source->streams()[0].size, 2);
  EXPECT_EQ(source->streams()[1].size, 1);
  EXPECT_TRUE(source->truths().empty());
  EXPECT_EQ(source->size(), -1);
  Frame frame;
  ASSERT_TRUE(source->Next(frame));
  EXPECT_EQ(frame.measurements[0].values, (std::vector<double>{2.0, 1.0}));
  EXPECT_FALSE(source->Next(frame));
}

TEST_F(Csv, GainAndReciprocalScaleTheColumn) {
  // 1000 mm = 1 m; 3 / 4 = 0.75.
  const auto frames = Frames("t_s,a,b\n0,1000,4\n",
                             "path: a.csv\nstreams: {m: {columns: a, gain: 1e-3}, r: {columns: "
                             "[b], reciprocal: true, gain: 3}}\n");
  EXPECT_DOUBLE_EQ(frames[0].measurements[0].values[0], 1.0);
  EXPECT_DOUBLE_EQ(frames[0].measurements[1].values[0], 0.75);
}

TEST_F(Csv, AcceptsCommentsCarriageReturnsAndByteOrderMark) {
  const auto frames = Frames(
      "\xEF\xBB\xBF# made by hand\r\n\r\nt_s , \"z\"\r\n# rows\r\n0, +1.5\r\n\r\n"
      "1,\t-2e0 \r\n2,.5",
      "path: a.csv\nstreams: {depth: z}\n");
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames[0].measurements[0].values[0], 1.5);
  EXPECT_EQ(frames[1].measurements[0].values[0], -2.0);
  EXPECT_EQ(frames[2].measurements[0].values[0], 0.5);  // complete, though no line feed ends it
}

TEST_F(Csv, IgnoresColumnsThatNobodyNames) {
  const auto frames = Frames("t_s,note,z\n0,a car,1\n1,nan,2\n", "path: a.csv\nstreams: {z: z}\n");
  EXPECT_EQ(frames.size(), 2u);
}

TEST_F(Csv, SeparatesAsTold) {
  const std::string text = "t_s;z\n0;1\n";
  EXPECT_EQ(Frames(text, "path: a.csv\nseparator: ;\nstreams: {z: z}\n").size(), 1u);
  Write("t_s\tz\tw\n0\t\t5\n");
  EXPECT_EQ(Held(Frames("path: a.csv\nseparator: \"\\t\"\nstreams: {z: z, w: w}\n")[0]), "1 |");
  ExpectBadConfig("path: a.csv\nseparator: \"1\"\nstreams: {z: z}\n",
                  "run.yaml:2:12 separator: not a separator; expected one character that numbers "
                  "do not hold, as in ';' or \"\\t\"");
}

TEST_F(Csv, EmptyCellIsMissing) {
  const auto frames = Frames(std::string(kHeader) + "0,,1,5\n1,2, ,\n2,,,\n", kDepthConfig);
  EXPECT_EQ(Held(frames[0]), "1 | 0");
  EXPECT_EQ(Held(frames[1]), "0 |");
  EXPECT_EQ(Held(frames[2]), "|");
}

TEST_F(Csv, PartOfAVectorIsMissingAsAWhole) {
  const auto frames = Frames("t_s,u,v\n0,1,\n1,1,2\n", "path: a.csv\nstreams: {pixel: [u, v]}\n");
  EXPECT_EQ(Held(frames[0]), "|");
  EXPECT_EQ(Held(frames[1]), "0 |");
}

TEST_F(Csv, FramesHoldNothingOfTheFrameBefore) {
  Write("t_s,a,b\n0,1,2\n1,,3\n");
  const auto source = Open("path: a.csv\nstreams: {a: a, b: b}\n");
  Frame frame;
  source->Next(frame);
  frame.measurements[0].covariance = {9.0};
  frame.measurements[0].landmark = 4;
  ASSERT_TRUE(source->Next(frame));
  ASSERT_EQ(Held(frame), "1 |");
  EXPECT_EQ(frame.measurements[0].values, std::vector<double>{3.0});
  EXPECT_TRUE(frame.measurements[0].covariance.empty());
  EXPECT_EQ(frame.measurements[0].landmark, -1);
}

TEST_F(Csv, MissingWordsReplaceTheEmptyCell) {
  const std::string config = "path: a.csv\nmissing: [nan, \"-\"]\nstreams: {z: z}\n";
  const auto frames = Frames("t_s,z\n0,nan\n1,-\n2,3\n", config);
  EXPECT_EQ(Held(frames[0]) + Held(frames[1]) + Held(frames[2]), "||0 |");
  ExpectBadData("t_s,z\n0,\n", "FILE:2:3 z: '' is not a number; expected a finite number", config);
}

TEST_F(Csv, TimeHasAUnit) {
  const auto stamps = [&](const std::string& unit, const std::string& rows) {
    return Stamps(Frames("t\n" + rows,
                         "path: a.csv\ntime: {column: t, unit: " + unit + "}\nstreams: {z: t}\n"));
  };
  EXPECT_EQ(stamps("s", "-0.5\n0.0000000014\n0.0000000016\n"),
            (std::vector<Stamp>{-500'000'000, 1, 2}));
  EXPECT_EQ(stamps("ms", "33\n+66.5\n1e2\n"),
            (std::vector<Stamp>{33'000'000, 66'500'000, 100'000'000}));
  EXPECT_EQ(stamps("us", "-.0006\n.5\n1.\n"), (std::vector<Stamp>{-1, 500, 1000}));
  EXPECT_EQ(stamps("ns", "1\n2\n"), (std::vector<Stamp>{1, 2}));
}

TEST_F(Csv, TimeSince1970KeepsEveryNanosecond) {
  // Doubles near 1.4e18 are 256 apart, near 1.4e9 they are 2.4e-7 apart.
  const Stamp first = 1'403'636'579'763'555'584;
  EXPECT_EQ(Stamps(Frames("t,z\n1403636579763555584,1\n1403636579763555585,1\n",
                          "path: a.csv\ntime: {column: t, unit: ns}\nstreams: {z: z}\n")),
            (std::vector<Stamp>{first, first + 1}));
  EXPECT_EQ(Stamps(Frames("t_s,z\n1403636579.763555584,1\n1403636579.763555585,1\n",
                          "path: a.csv\nstreams: {z: z}\n")),
            (std::vector<Stamp>{first, first + 1}));
}

TEST_F(Csv, RateStandsInForTime) {
  const std::string config = "path: a.csv\nrate_hz: 30\nstreams: {z: z}\n";
  const auto frames = Frames("z\n1\n\n2\n", config);  // the blank line is a missing value
  EXPECT_EQ(Stamps(frames), (std::vector<Stamp>{0, 33'333'333, 66'666'667}));
  EXPECT_EQ(Held(frames[1]), "|");
  ExpectBadData("z,w\n1,2\n\n2,3\n", "FILE:3:1: 1 column; expected 2 columns, as in line 1",
                config);
}

TEST_F(Csv, NumbersDoNotDependOnTheLocale) {
  const std::string before = std::setlocale(LC_NUMERIC, nullptr);
  if (std::setlocale(LC_NUMERIC, "de_DE.UTF-8") == nullptr) GTEST_SKIP() << "no comma locale here";
  EXPECT_EQ(Frames("t_s,z\n0.5,1.25\n", "path: a.csv\nstreams: {z: z}\n")[0].measurements[0].values,
            std::vector<double>{1.25});
  std::setlocale(LC_NUMERIC, before.c_str());
}

TEST_F(Csv, LinesAcrossTheBufferAreWhole) {
  // 20000 rows of about 30 bytes: some ten times the buffer.
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

// ---- where it comes from ------------------------------------------------------------------------

TEST_F(Csv, DashIsStandardInput) {
  for (const char* written : {"\"-\"", "-"}) {
    Write("t_s,z\n0,1\n1,x\n");
    const int kept = dup(STDIN_FILENO), file = open(File().c_str(), O_RDONLY);
    dup2(file, STDIN_FILENO);
    close(file);
    config_ = std::make_unique<Config>(Config::FromText("path: q\nstreams: {z: z}\n", "run.yaml"));
    config_->Set("path", written, "--set");
    const auto source = OpenConfig();
    Frame frame;
    EXPECT_TRUE(source->Next(frame));
    ExpectError(ExitCode::kBadData, "<stdin>:3:3 z: 'x' is not a number; expected a finite number",
                [&] { source->Next(frame); });
    dup2(kept, STDIN_FILENO);
    close(kept);
  }
}

TEST_F(Csv, ReadsAPipeAsItIsWritten) {
  ASSERT_EQ(mkfifo(File().c_str(), 0600), 0);
  int descriptor = -1;
  std::thread writer([&] {
    descriptor = open(File().c_str(), O_WRONLY);
    EXPECT_EQ(write(descriptor, "t_s,z\n0,1\n1", 11), 11);
  });
  const auto source = Open("path: a.csv\nstreams: {z: z}\n");
  Frame frame;
  EXPECT_TRUE(source->Next(frame));  // comes although the pipe is still open
  writer.join();
  EXPECT_EQ(write(descriptor, ",2\n", 3), 3);
  EXPECT_TRUE(source->Next(frame));
  EXPECT_EQ(frame.measurements[0].values[0], 2.0);
  close(descriptor);
  EXPECT_FALSE(source->Next(frame));
}

TEST_F(Csv, ASignalEndsTheWaitForAPipe) {
  ASSERT_EQ(mkfifo(File().c_str(), 0600), 0);
  const int both_ends = open(File().c_str(), O_RDWR);  // never at its end
  ASSERT_EQ(write(both_ends, "t_s,z\n", 6), 6);
  const auto source = Open("path: a.csv\nstreams: {z: z}\n");
  struct sigaction action {
  }, before{};
  action.sa_handler = [](int) {};
  sigaction(SIGALRM, &action, &before);
  const itimerval every_50_ms{{0, 50000}, {0, 50000}}, never{};
  setitimer(ITIMER_REAL, &every_50_ms, nullptr);
  Frame frame;
  ExpectError(ExitCode::kStopped, "FILE:1: stopped by a signal while waiting for data",
              [&] { source->Next(frame); });
  setitimer(ITIMER_REAL, &never, nullptr);
  sigaction(SIGALRM, &before, nullptr);
  close(both_ends);
}

TEST_F(Csv, RefusesWhatCannotBeRead) {
  const auto expect = [&](const std::string& reason) {
    ExpectError(ExitCode::kInputMissing,
                "run.yaml:1:7 path: 'FILE': " + reason + "; expected a readable file",
                [&] { Open(); });
  };
  expect("No such file or directory");
  fs::create_directory(File());
  expect("Is a directory");
  fs::remove(File());
  if (geteuid() == 0) return;  // root may read everything
  Write("t_s\n");
  fs::permissions(File(), fs::perms::none);
  expect("Permission denied");
}

TEST_F(Csv, NoticesAFileThatChangesWhileItIsRead) {
  Write("t_s,z\n0,1\n");
  const auto source = Open("path: a.csv\nstreams: {z: z}\n");
  Frame frame;
  EXPECT_TRUE(source->Next(frame));
  std::ofstream(File(), std::ios::app) << "1,2\n";
  ExpectError(ExitCode::kIo, "FILE:3: changed while it was read", [&] {
    while (source->Next(frame)) {
    }
  });
}

TEST_F(Csv, StreamsALongFileInConstantMemory) {
  // A pipe of 2e6 rows, about 40 MB, written by a thread; the peak may grow by 4 MB.
  const auto peak_kb = [] {
    std::ifstream status("/proc/self/status");
    for (std::string word; status >> word;) {
      if (word == "VmHWM:") {
        status >> word;
        return std::stol(word);
      }
    }
    return 0L;
  };
  ASSERT_EQ(mkfifo(File().c_str(), 0600), 0);
  std::thread writer([&] {
    std::ofstream out(File());
    out << "t_s,z\n";
    for (int i = 0; i < 2000000; ++i) out << i << ",1.234567890\n";
  });
  const auto source = Open("path: a.csv\nstreams: {z: z}\n");
  Frame frame;
  const long before = peak_kb();
  int count = 0;
  while (source->Next(frame)) ++count;
  writer.join();
  EXPECT_EQ(count, 2000000);
  EXPECT_LT(peak_kb() - before, 4096);
}

// ---- blind_after --------------------------------------------------------------------------------

TEST_F(Csv, BlindAfterDropsTheFirstStreamInTheRestOfTheSeries) {
  std::string text = std::string("# c\n") + kHeader;
  for (int i = 0; i < 7; ++i) text += std::to_string(i) + ",1,2,3\n\n";
  Write(text);
  const auto seen = [&](const std::string& share) {
    int count = 0;
    bool ended = false;
    const auto source = Open(kDepthConfig + ("blind_after: " + share + "\n"));
    EXPECT_EQ(source->size(), share == "1" ? -1 : 7);  // 1 drops nothing: no need to count
    for (Frame frame; source->Next(frame);) {
      const std::string held = Held(frame);
      EXPECT_TRUE(held == "0 1 | 0" || held == "1 | 0") << held;
      ended |= held == "1 | 0";
      EXPECT_EQ(held == "1 | 0", ended);  // once blind, blind
      count += ended ? 0 : 1;
    }
    return count;
  };
  // Rows k = 0 .. 6 are seen while k < 7 F.
  EXPECT_EQ(seen("0"), 0);
  EXPECT_EQ(seen("0.1"), 1);
  EXPECT_EQ(seen("0.5"), 4);
  EXPECT_EQ(seen("1"), 7);
}

TEST_F(Csv, BlindAfterIsExactWhereTheShareIs) {
  // 0.07 * 100 is 7.000000000000001 in doubles.
  std::string text = "t_s,z\n";
  for (int i = 0; i < 100; ++i) text += std::to_string(i) + ",1\n";
  Write(text);
  int seen = 0;
  for (const Frame& frame : Frames("path: a.csv\nblind_after: 0.07\nstreams: {z: z}\n")) {
    seen += static_cast<int>(frame.measurements.size());
  }
  EXPECT_EQ(seen, 7);
}

TEST_F(Csv, BlindNamesTheStreams) {
  Write(std::string(kHeader) + "0,1,2,3\n1,1,2,3\n");
  const std::string config = kDepthConfig + std::string("blind_after: 0.5\n");
  EXPECT_EQ(Held(Frames(config + "blind: inverse_scale\n")[1]), "0 | 0");
  EXPECT_EQ(Held(Frames(config + "blind: [inverse_scale, disparity]\n")[1]), "| 0");
  ExpectBadConfig(config + "blind: [disparty]\n",
                  "run.yaml:5:9 blind[0]: no stream 'disparty'; did you mean 'disparity'?");
  ExpectBadConfig(kDepthConfig + std::string("blind: disparity\n"),
                  "run.yaml:4:8 blind: without 'blind_after' no stream goes blind; expected "
                  "'blind_after' beside it");
}

TEST_F(Csv, BlindAfterNeedsAFileThatCanBeReadTwice) {
  ASSERT_EQ(mkfifo(File().c_str(), 0600), 0);
  const int both_ends = open(File().c_str(), O_RDWR);
  ASSERT_EQ(write(both_ends, kHeader, std::strlen(kHeader)), std::strlen(kHeader));
  ExpectBadConfig(kDepthConfig + std::string("blind_after: 0.5\n"),
                  "run.yaml:4:14 blind_after: 'FILE' is a pipe, which cannot be read twice; "
                  "expected a regular file, whose rows can be counted first");
  ASSERT_EQ(write(both_ends, kHeader, std::strlen(kHeader)), std::strlen(kHeader));
  ASSERT_EQ(write(both_ends, "0,1,2,3\n", 8), 8);
  const auto source = Open(kDepthConfig + std::string("blind_after: 1\n"));
  Frame frame;
  ASSERT_TRUE(source->Next(frame));
  EXPECT_EQ(Held(frame), "0 1 | 0");
  close(both_ends);
}

// ---- bad data -----------------------------------------------------------------------------------

TEST_F(Csv, WrongNumberOfColumns) {
  ExpectBadData(std::string("# c\n") + kHeader + "0,1,2,3\n1,2,3\n",
                "FILE:4:6: 3 columns; expected 4 columns, as in line 2");
  ExpectBadData(std::string(kHeader) + "0,1,2,3,4\n",
                "FILE:2:9: 5 columns; expected 4 columns, as in line 1");
}

TEST_F(Csv, TruncatedLastLine) {
  ExpectBadData(
      std::string(kHeader) + "0,1,2,3\n1,2",
      "FILE:3:4: the last line is cut short: 2 columns; expected 4 columns, as in line 1");
}

TEST_F(Csv, NotANumber) {
  const auto expect = [&](const std::string& cell) {
    ExpectBadData(
        std::string(kHeader) + "0, " + cell + ",2,3\n",
        "FILE:2:3 disparity_px: '" + cell + "' is not a number; expected a finite number");
  };
  for (const char* cell : {"abc", "6.5x", "0x10", "1.5.2", "+-1", "--1", "+", "1e", "1 2"}) {
    expect(cell);
  }
}

TEST_F(Csv, ShowsHostileCellsHarmlessly) {
  ExpectBadData(std::string(kHeader) + "0,\x1b[31m" + std::string(50, 'y') + ",2,3\n",
                "FILE:2:3 disparity_px: '?[31m" + std::string(35, 'y') +
                    "...' is not a number; expected a finite number");
  ExpectBadData(std::string(kHeader) + "0," + std::string(1, '\0') + ",2,3\n",
                "FILE:2:3 disparity_px: '?' is not a number; expected a finite number");
}

TEST_F(Csv, NotFinite) {
  for (const std::string cell : {"nan", "inf", "-inf", "NaN", "Infinity"}) {
    ExpectBadData(std::string(kHeader) + "0,1," + cell + ",3\n",
                  "FILE:2:5 scale: '" + cell + "' is not finite; expected a finite number");
  }
}

TEST_F(Csv, Overflow) {
  for (const std::string cell : {"1e400", "-1e400", "1e-400"}) {
    ExpectBadData(std::string(kHeader) + "0,1,2," + cell + "\n",
                  "FILE:2:7 reference_depth_m: '" + cell +
                      "' is too large or too small; expected a finite number");
  }
}

TEST_F(Csv, ReciprocalOfZero) {
  ExpectBadData(std::string(kHeader) + "0,1,0,3\n",
                "FILE:2:5 scale: '0' has no finite reciprocal; expected a finite number");
}

TEST_F(Csv, LineTooLong) {
  // "0,1,2," and a number: 4096 bytes are read, one more is refused, line end not counted.
  const auto row = [](std::size_t length) { return "0,1,2,3." + std::string(length - 8, '0'); };
  for (const std::string end : {"", "\n", "\r\n"}) {
    EXPECT_EQ(Frames(kHeader + row(4096) + end, kDepthConfig).size(), 1u);
    ExpectBadData(kHeader + row(4097) + end,
                  "FILE:2:1: line too long; expected at most 4096 bytes a line");
  }
  ExpectBadData(kHeader + row(200000),
                "FILE:2:1: line too long; expected at most 4096 bytes a line");
}

TEST_F(Csv, LongestLineMayEndAcrossTheBuffer) {
  // The buffer of 65536 bytes ends between the '\r' and the '\n' of a line of 4096 bytes: still one
  // line, of which the next is counted.
  std::string text = kHeader;
  while (text.size() + 4097 + 4000 < 65536) text += '#' + std::string(3998, ' ') + '\n';
  text += '#' + std::string(65536 - 4097 - 2 - text.size(), ' ') + '\n';
  const auto before = std::count(text.begin(), text.end(), '\n');
  text += "0,1,2,3." + std::string(4088, '0') + "\r\nx,1,2,3\n";
  ExpectBadData(text, "FILE:" + std::to_string(before + 2) +
                          ":1 t_s: 'x' is not a number; expected a finite number");
}

TEST_F(Csv, TimeMustIncrease) {
  ExpectBadData(std::string(kHeader) + "0,1,2,3\n0.2,1,2,3\n# c\n0.1,1,2,3\n",
                "FILE:5:1 t_s: '0.1' is before line 3; expected times that increase");
  ExpectBadData(std::string(kHeader) + "0,1,2,3\n0.2,1,2,3\n0.2000000001,1,2,3\n",
                "FILE:4:1 t_s: '0.2000000001' is the same time as line 3; expected times that "
                "increase");
}

TEST_F(Csv, TimeBeyondTheStamps) {
  ExpectBadData(std::string(kHeader) + "9.3e9,1,2,3\n",
                "FILE:2:1 t_s: '9.3e9' is beyond 292 years; expected a finite number");
  ExpectBadData(std::string(kHeader) + ",1,2,3\n",
                "FILE:2:1 t_s: '' is not a number; expected a finite number");
}

TEST_F(Csv, NothingAtAll) {
  ExpectBadData("", "FILE: no header line; expected a line that names the columns");
  ExpectBadData("# c\n\n", "FILE: no header line; expected a line that names the columns");
  ExpectBadData(kHeader, "FILE: no data rows; expected a row below the header");
}

// ---- bad config ---------------------------------------------------------------------------------

TEST_F(Csv, UnknownColumn) {
  Write(std::string(kHeader) + "0,1,2,3\n");
  ExpectBadConfig("path: a.csv\nstreams: {d: [disparity_pc]}\n",
                  "run.yaml:2:15 streams.d[0]: no column 'disparity_pc' in FILE; expected one of "
                  "t_s, disparity_px, scale, reference_depth_m; did you mean 'disparity_px'?");
  ExpectBadConfig("path: a.csv\nstreams: {d: scale}\ntime: {column: stamp}\n",
                  "run.yaml:3:16 time.column: no column 'stamp' in FILE; expected one of t_s, "
                  "disparity_px, scale, reference_depth_m");
}

TEST_F(Csv, ColumnNamedTwice) {
  Write("t_s,z,z\n0,1,2\n");
  ExpectBadConfig("path: a.csv\nstreams: {z: z}\n",
                  "run.yaml:2:14 streams.z: FILE has two columns 'z'; expected one");
}

TEST_F(Csv, UnknownAndMissingKeys) {
  Write(std::string(kHeader) + "0,1,2,3\n");
  ExpectBadConfig("path: a.csv\nstreams: {d: {columns: scale, recipocal: true}}\n",
                  "run.yaml:2:31 streams.d.recipocal: unknown key; did you mean 'reciprocal'?");
  ExpectBadConfig("path: a.csv\nstreams: {d: scale}\nblind_afer: 0.5\n",
                  "run.yaml:3:1 blind_afer: unknown key; did you mean 'blind_after'?");
  ExpectBadConfig("path: a.csv\nstreams: {}\n",
                  "run.yaml:2:10 streams: no streams; expected a map, as in 'disparity: "
                  "disparity_px'");
  ExpectBadConfig("streams: {d: scale}\n", "run.yaml:1:1 path: missing key, needed by 'csv'");
}

TEST_F(Csv, GainOfNothing) {
  Write("t_s,z\n0,1\n");
  ExpectBadConfig("path: a.csv\nstreams: {z: {columns: z, gain: 0}}\n",
                  "run.yaml:2:33 streams.z.gain: 0 leaves nothing of the column; expected a number "
                  "but 0");
}

TEST_F(Csv, TimeAndRateExcludeEachOther) {
  ExpectBadConfig("path: a.csv\ntime: {column: t_s}\nrate_hz: 30\nstreams: {d: scale}\n",
                  "run.yaml:3:10 rate_hz: 'time' and 'rate_hz' are both given; expected one of "
                  "them");
}

}  // namespace
}  // namespace alidade
