// SPDX-License-Identifier: Apache-2.0
#include "alidade/recorder.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <functional>
#include <optional>
#include <sstream>

#include "core/src/number_text.h"
#include "core/src/sha256.h"
#include "support/systems.h"

namespace {

/// The n-th call of write, fsync or rename by this process fails with `error`; 0: none does.
int fail_at = 0;
int fail_error = 0;

bool IsToFail() {
  if (fail_at == 0 || --fail_at > 0) return false;
  errno = fail_error;
  return true;
}

}  // namespace

// These stand before those of the C library, for the shared libraries of this process too.
extern "C" {
__attribute__((visibility("default"))) ssize_t write(int fd, const void* data, size_t size) {
  return IsToFail() ? -1 : syscall(SYS_write, fd, data, size);
}
__attribute__((visibility("default"))) int fsync(int fd) {
  static_cast<void>(fd);  // tests need not survive a power cut
  return IsToFail() ? -1 : 0;
}
__attribute__((visibility("default"))) int rename(const char* from, const char* to) noexcept {
  return IsToFail() ? -1
                    : static_cast<int>(syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0));
}
}

namespace alidade {
namespace {

namespace fs = std::filesystem;

/// A folder that is gone with its owner.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "alidade-XXXXXX").string();
    path_ = ::mkdtemp(name.data());
  }
  ~TemporaryFolder() { fs::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  fs::path operator/(const fs::path& name) const { return path_ / name; }
  const fs::path& path() const { return path_; }
  bool empty() const { return fs::is_empty(path_); }

 private:
  fs::path path_;
};

std::string Read(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  EXPECT_TRUE(stream.is_open()) << file;
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

std::vector<std::string> Lines(const fs::path& file) {
  std::istringstream text(Read(file));
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  return lines;
}

std::vector<std::string> Cells(const std::string& line) {
  std::vector<std::string> cells = {""};
  for (const char c : line) {
    if (c == ',') {
      cells.emplace_back();
    } else {
      cells.back() += c;
    }
  }
  return cells;
}

/// Depth 0.3 + 0.1 sin(0.4 * 2 pi t), measured exactly but for a wobble; its disparity on every
/// other frame.
class SwingingTarget : public Source {
 public:
  explicit SwingingTarget(int frames) : frames_(frames) {}
  const std::vector<StreamInfo>& streams() const override { return streams_; }
  const std::vector<StreamInfo>& truths() const override { return truths_; }
  bool Next(Frame& frame) override {
    if (next_ == frames_) return false;
    const double t_s = 0.033 * next_;
    const double depth = 0.3 + 0.1 * std::sin(2.5133 * t_s), wobble = std::sin(37.0 * next_);
    frame = testing::FrameAt(t_s, {{1, depth / 0.3 + 0.002 * wobble}});
    if (next_ % 2 == 0) {
      frame.measurements.push_back({frame.stamp, 0, -1, {26.0 / depth + wobble}, {}});
    }
    frame.truth = {{depth}};
    if (next_ == 3) frame.truth = {{}};
    ++next_;
    return true;
  }

 private:
  std::vector<StreamInfo> streams_ = {{"disparity", 1}, {"inverse_scale", 1}};
  std::vector<StreamInfo> truths_ = {{"depth", 1}};
  int frames_, next_ = 0;
};

Experiment MakeExperiment(int frames = 60) {
  Experiment experiment;
  experiment.source = std::make_unique<SwingingTarget>(frames);
  for (const char* name : {"ekf", "alone"}) {
    Contestant contestant;
    contestant.name = name;
    contestant.type = "ekf";
    contestant.system = testing::DepthFilter();
    if (contestant.name == "alone") contestant.system.sensors.pop_back();
    contestant.estimator =
        std::make_unique<Ekf>(contestant.system, EkfOptions{}, experiment.source->streams());
    experiment.contestants.push_back(std::move(contestant));
  }
  experiment.seed = 42;
  return experiment;
}

const PluginHost& Host() {
  static const PluginHost host;
  return host;
}

Config MakeConfig() {
  return Config::FromText("alidade: 1\ntitle: A <swinging> target\n", "swing.yaml");
}

Recorder::Options OptionsFor(const fs::path& folder, bool force = false, bool figures = false) {
  return {folder, force, figures, "alidade run swing.yaml"};
}

/// Runs what `recorder` is to record.
RunResult RunInto(Recorder& recorder, Experiment& experiment) {
  RunOptions options;
  options.recorder = &recorder;
  return Run(experiment, options);
}

void Record(const Recorder::Options& options, int frames = 60) {
  Experiment experiment = MakeExperiment(frames);
  Recorder recorder(options, MakeConfig(), Host());
  RunResult result = RunInto(recorder, experiment);
  result.contestants[0].events.push_back({33'000'000, "note", "a \"word\", and\nanother"});
  result.contestants[0].events.push_back({kNoStamp, "note", "timeless"});
  recorder.Finish(result);
}

/// What `call` fails with, 0 where it does not; its text goes to `text`.
template <class Call>
int CodeOf(const Call& call, std::string* text = nullptr) {
  try {
    call();
  } catch (const Error& error) {
    if (text != nullptr) *text = error.what();
    return static_cast<int>(error.code());
  }
  return 0;
}

/// Exit code of `call` in a child process; 128 + n where signal n ended it.
template <class Call>
int InChild(const Call& call) {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(CodeOf(call));
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

std::vector<std::string> FilesIn(const fs::path& folder) {
  std::vector<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) files.push_back(entry.path().lexically_relative(folder).string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

TEST(Recorder, WritesEveryFile) {
  const TemporaryFolder folder;
  Record(OptionsFor(folder / "above" / "out"));
  EXPECT_EQ(
      FilesIn(folder / "above" / "out"),
      (std::vector<std::string>{"alone/estimates.csv", "alone/events.csv", "alone/gains.csv",
                                "alone/innovations.csv", "comparison.csv", "config.resolved.yaml",
                                "ekf/estimates.csv", "ekf/events.csv", "ekf/gains.csv",
                                "ekf/innovations.csv", "implied.csv", "measurements.csv",
                                "report.html", "run.json", "timing.json", "truth.csv"}));
  EXPECT_EQ(FilesIn(folder.path()).size(), 16u);  // nothing beside it
}

TEST(Recorder, EstimatesRoundTrip) {
  const TemporaryFolder folder;
  Experiment experiment = MakeExperiment();
  Recorder recorder(OptionsFor(folder / "out"), MakeConfig(), Host());
  recorder.Finish(RunInto(recorder, experiment));
  const std::vector<std::string> lines = Lines(folder / "out/ekf/estimates.csv");
  ASSERT_EQ(lines.size(), 61u);
  EXPECT_EQ(lines[0],
            "t_s,target.depth,sigma:target.depth,target.depth_rate,sigma:target.depth_rate,"
            "template.inverse_distance,sigma:template.inverse_distance");
  const std::vector<std::string> last = Cells(lines[60]);
  ASSERT_EQ(last.size(), 7u);
  EXPECT_EQ(last[0], "1.947000000");
  const State& state = experiment.contestants[0].estimator->state();
  for (int id = 0; id < 3; ++id) {
    EXPECT_EQ(last[1 + 2 * id], internal::NumberText(*state.value(id)));
    EXPECT_EQ(last[2 + 2 * id], internal::NumberText(std::sqrt(state.covariance().Variance(id))));
  }
}

TEST(Recorder, KeepsMeasurementsAndTruthAsTheyCame) {
  const TemporaryFolder folder;
  Record(OptionsFor(folder / "out"));
  SwingingTarget source(60);
  Frame frame;
  std::vector<std::string> measurements = {"t_s,stream,landmark,v0"}, truth = {"t_s,depth"};
  while (source.Next(frame)) {
    std::string t;
    internal::AppendSeconds(t, frame.stamp);
    for (const Measurement& m : frame.measurements) {
      measurements.push_back(t + ',' + source.streams()[m.stream].name + ",," +
                             internal::NumberText(m.values[0]));
    }
    truth.push_back(t + ',' +
                    (frame.truth[0].empty() ? "" : internal::NumberText(frame.truth[0][0])));
  }
  EXPECT_EQ(Lines(folder / "out/measurements.csv"), measurements);
  EXPECT_EQ(Lines(folder / "out/truth.csv"), truth);
}

TEST(Recorder, ImpliedValuesInvertTheSensor) {
  const TemporaryFolder folder;
  Record(OptionsFor(folder / "out"), 3);
  SwingingTarget source(1);
  Frame frame;
  ASSERT_TRUE(source.Next(frame));
  const std::vector<std::string> lines = Lines(folder / "out/implied.csv");
  ASSERT_EQ(lines.size(), 3u);  // of disparity alone: a scale tells no distance by itself
  EXPECT_EQ(lines[0], "t_s,sensor,target.depth");
  EXPECT_EQ(lines[1], "0.000000000,disparity," +
                          internal::NumberText(400.0 * 0.065 / frame.measurements[1].values[0]));
}

/// A report of one update, made by hand, on a system with a block that waits and one that is fixed.
struct HandMade {
  Experiment experiment;
  State state;
  Frame frame;
  UpdateReport report;

  HandMade() {
    experiment.source = std::make_unique<SwingingTarget>(1);
    Contestant contestant;
    contestant.name = "hand";
    contestant.type = "fake";
    StateLayout& layout = contestant.system.layout;
    const Space scalar{"x", "m", "", {""}, Geometry::Vector(1)};
    layout.Declare("a.waits", "a", scalar);
    layout.Declare("a.fixed", "a", scalar, BlockStatus::kFixed);
    layout.Declare("a.attitude", "a",
                   {"q", "rad", "", {"w", "x", "y", "z"}, Geometry::UnitQuaternion()});
    testing::AddSensor(contestant.system, "disparity",
                       InProcessSensor(StereoDisparity(400.0, 0.065, 1.0, 0.3), "stereo_disparity"),
                       {"a.waits"});
    state = State(layout);
    const double fixed = 0.25, attitude[4] = {1.0, 0.0, 0.0, 0.0};
    state.Add(1, &fixed, Eigen::MatrixXd());
    state.Add(2, attitude, Eigen::Vector3d(1.0, 4.0, 9.0).asDiagonal());
    experiment.contestants.push_back(std::move(contestant));
    frame = testing::FrameAt(5e-9, {{0, 90.0}});  // 0.289 m, nearer than stereo sees
    MeasurementReport accepted;
    accepted.sensor = 0;
    accepted.dof = 1;
    accepted.nis = 0.5;
    accepted.z = {80.0};
    accepted.h = {79.0};
    accepted.innovation = Eigen::VectorXd::Constant(1, 1.0);
    accepted.s = Eigen::MatrixXd::Constant(1, 1, 2.25);
    accepted.gain = Eigen::Vector3d(0.1, 0.0, -0.3);
    MeasurementReport invalid;
    invalid.sensor = 0;
    invalid.dof = 1;
    invalid.landmark = 17;
    invalid.outcome = Outcome::kInvalid;
    invalid.z = {-1.0};
    report.measurements = {accepted, invalid};
  }
};

TEST(Recorder, WritesAbsentFixedAndRejected) {
  const TemporaryFolder folder;
  HandMade hand;
  Recorder recorder(OptionsFor(folder / "out"), MakeConfig(), Host());
  recorder.Start(hand.experiment);
  recorder.AddFrame(hand.frame);
  recorder.AddEstimate(0, hand.frame, hand.state, hand.report);
  RunResult result;
  result.contestants.resize(1);
  result.contestants[0].name = "hand";
  recorder.Finish(result);
  EXPECT_EQ(
      Read(folder / "out/hand/estimates.csv"),
      "t_s,a.waits,sigma:a.waits,a.fixed,sigma:a.fixed,a.attitude.w,a.attitude.x,a.attitude.y,"
      "a.attitude.z,sigma:a.attitude.rx,sigma:a.attitude.ry,sigma:a.attitude.rz\n"
      "0.000000005,,,0.25,,1,0,0,0,1,2,3\n");
  EXPECT_EQ(Read(folder / "out/hand/innovations.csv"),
            "t_s,stream,sensor,landmark,outcome,dof,nis,z0,h0,s0,r0\n"
            "0.000000005,disparity,disparity,,accepted,1,0.5,80,79,1.5,1\n"
            "0.000000005,disparity,disparity,17,invalid,1,,-1,,,\n");
  EXPECT_EQ(Read(folder / "out/hand/gains.csv"),
            "t_s,sensor,a.waits<-disparity,a.attitude.rx<-disparity,a.attitude.ry<-disparity,"
            "a.attitude.rz<-disparity\n"
            "0.000000005,disparity,,0.1,0,-0.3\n");
  EXPECT_EQ(Read(folder / "out/implied.csv"), "t_s,sensor,a.waits\n");  // invalid: implies nothing
}

TEST(Recorder, QuotesTextsInEvents) {
  const TemporaryFolder folder;
  Record(OptionsFor(folder / "out"));
  EXPECT_EQ(Read(folder / "out/ekf/events.csv"),
            "t_s,kind,text\n"
            "0.033000000,note,\"a \"\"word\"\", and\nanother\"\n"
            ",note,timeless\n");
}

TEST(Recorder, RunJsonHasTheAgreedKeys) {
  const TemporaryFolder folder;
  RunResult result;
  result.status = RunStatus::kFailed;
  result.reason = "it \"broke\"";
  result.frames = 7;
  ContestantResult one;
  one.name = "ekf";
  one.metrics = {{"rmse:target.depth", 0.00195}, {"final:target.depth", INFINITY}};
  one.counts = {{"accepted:stereo", 151}};
  one.units = {{"target.depth", "m"}};
  one.diverged = true;
  one.events = {{0, "lockout", ""}, {1, "lockout", ""}, {2, "diverged", ""}};
  one.unobservable = {{"a.x", "b.y"}};
  result.contestants = {one};
  Recorder recorder(OptionsFor(folder / "out"), MakeConfig(), Host());
  const Experiment experiment = MakeExperiment();
  recorder.Start(experiment);
  recorder.Finish(result);
  EXPECT_EQ(Read(folder / "out/run.json"), R"({
  "status": "failed",
  "reason": "it \"broke\"",
  "versions": {
    "alidade": "0.1.0"
  },
  "seed": 42,
  "frames": 7,
  "plugins": [],
  "estimators": {
    "ekf": {
      "type": "ekf",
      "metrics": {
        "final:target.depth": null,
        "rmse:target.depth": 0.00195,
        "diverged": true
      },
      "counts": {
        "accepted:stereo": 151
      },
      "units": {
        "target.depth": "m"
      },
      "events": {
        "diverged": 1,
        "lockout": 2
      },
      "unobservable": [
        [
          "a.x",
          "b.y"
        ]
      ]
    }
  }
}
)");
  EXPECT_EQ(Read(folder / "out/comparison.csv"),
            "metric,ekf\nrmse:target.depth,0.00195\nfinal:target.depth,inf\naccepted:stereo,151\n"
            "diverged,true\n");
}

TEST(Recorder, SaysWhatFailedBeforeTheExperimentWasKnown) {
  const TemporaryFolder folder;
  Recorder recorder(OptionsFor(folder / "out"), MakeConfig(), Host());
  RunResult result;
  result.status = RunStatus::kStopped;
  recorder.Finish(result);
  EXPECT_NE(Read(folder / "out/run.json").find("\"status\": \"stopped\""), std::string::npos);
}

TEST(Recorder, SameRunGivesSameBytes) {
  const TemporaryFolder folder;
  Record(OptionsFor(folder / "one", false, true));
  Record(OptionsFor(folder / "another", false, true));
  const std::vector<std::string> files = FilesIn(folder / "one");
  EXPECT_EQ(files, FilesIn(folder / "another"));
  for (const std::string& file : files) {
    if (file == "timing.json") continue;
    EXPECT_EQ(Read(folder / "one" / file), Read(folder / "another" / file)) << file;
  }
}

TEST(Recorder, DrawsWhereGnuplotIs) {
  const TemporaryFolder folder;
  Recorder recorder(OptionsFor(folder / "out", false, true), MakeConfig(), Host());
  Experiment experiment = MakeExperiment();
  recorder.Finish(RunInto(recorder, experiment));
  const std::string report = Read(folder / "out/report.html");
  EXPECT_NE(report.find("A &lt;swinging&gt; target"), std::string::npos);
  ASSERT_EQ(recorder.highlights().front(), "report.html");
  for (const std::string& file : recorder.highlights()) {
    EXPECT_TRUE(fs::exists(folder / "out" / file)) << file;
  }
  if (recorder.note() == "gnuplot is not installed: no figures") GTEST_SKIP() << recorder.note();
  EXPECT_EQ(recorder.note(), "");
  EXPECT_EQ(recorder.highlights()[1], "figures/measurements.png");
  for (const char* name : {"measurements", "comparison", "ekf.state", "ekf.covariance", "ekf.gain",
                           "ekf.innovation", "alone.state"}) {
    const fs::path figure = folder / "out/figures" / name;
    EXPECT_GT(fs::file_size(figure.string() + ".svg"), 5000u) << name;
    EXPECT_TRUE(fs::exists(figure.string() + ".gp")) << name;
  }
  EXPECT_NE(report.find("<svg"), std::string::npos);
}

TEST(Recorder, DoesWithoutGnuplot) {
  const TemporaryFolder folder;
  const int code = InChild([&] {
    ::setenv("PATH", "/nowhere", 1);
    Recorder recorder(OptionsFor(folder / "out", false, true), MakeConfig(), Host());
    Experiment experiment = MakeExperiment();
    recorder.Finish(RunInto(recorder, experiment));
    if (recorder.note() != "gnuplot is not installed: no figures") ::_exit(1);
  });
  EXPECT_EQ(code, 0);
  EXPECT_TRUE(fs::exists(folder / "out/report.html"));
  EXPECT_FALSE(fs::exists(folder / "out/figures/measurements.svg"));
}

TEST(Recorder, LeavesAnExistingFolderAlone) {
  const TemporaryFolder folder;
  Record(OptionsFor(folder / "out"), 3);
  const std::string before = Read(folder / "out/run.json");
  std::string text;
  EXPECT_EQ(CodeOf([&] { Record(OptionsFor(folder / "out"), 5); }, &text), 73);
  EXPECT_EQ(text, (folder / "out").string() + ": exists already; add --force to replace it");
  EXPECT_EQ(Read(folder / "out/run.json"), before);
  EXPECT_EQ(CodeOf([&] { Record(OptionsFor(folder / "out/"), 5); }), 73);
}

TEST(Recorder, ForceReplacesARunFolder) {
  const TemporaryFolder folder;
  Record(OptionsFor(folder / "out"), 3);
  std::ofstream(folder / "out/mine.txt") << "x";
  Record(OptionsFor(folder / "out", true), 5);
  EXPECT_EQ(Lines(folder / "out/truth.csv").size(), 6u);
  EXPECT_FALSE(fs::exists(folder / "out/mine.txt"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);  // the old one is gone
}

TEST(Recorder, ForceSparesWhatIsNoRunFolder) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "home");
  std::ofstream(folder / "home/thesis.tex") << "x";
  std::ofstream(folder / "file") << "x";
  EXPECT_EQ(CodeOf([&] { Record(OptionsFor(folder / "home", true)); }), 73);
  EXPECT_EQ(CodeOf([&] { Record(OptionsFor(folder / "file", true)); }), 73);
  EXPECT_EQ(Read(folder / "home/thesis.tex"), "x");
  fs::remove(folder / "home/thesis.tex");
  EXPECT_EQ(CodeOf([&] { Record(OptionsFor(folder / "home", true)); }), 0);  // empty
}

TEST(Recorder, AFolderBeingWrittenIsRefused) {
  const TemporaryFolder folder;
  const Recorder first(OptionsFor(folder / "out"), MakeConfig(), Host());
  std::string text;
  EXPECT_EQ(CodeOf([&] { Record(OptionsFor(folder / "out")); }, &text), 73);
  EXPECT_NE(text.find("process " + std::to_string(::getpid()) + " is writing it now"),
            std::string::npos)
      << text;
  Record(OptionsFor(folder / "other"));  // another name is free
}

TEST(Recorder, RemovesWhatADeadProcessLeft) {
  const TemporaryFolder folder;
  fs::create_directories(folder / ".out.partial-1/ekf");  // process 1 lives, but does not hold it
  fs::create_directories(folder / ".other.partial-1");
  Record(OptionsFor(folder / "out"));
  EXPECT_FALSE(fs::exists(folder / ".out.partial-1"));
  EXPECT_TRUE(fs::exists(folder / ".other.partial-1"));
}

TEST(Recorder, RestoresWhatADeadProcessWasReplacing) {
  const TemporaryFolder folder;
  Record(OptionsFor(folder / "out"), 3);
  fs::rename(folder / "out", folder / ".out.old-1");
  EXPECT_EQ(CodeOf([&] { Record(OptionsFor(folder / "out")); }), 73);
  EXPECT_EQ(Lines(folder / "out/truth.csv").size(), 4u);
}

TEST(Recorder, LeavesNothingWithoutFinish) {
  const TemporaryFolder folder;
  {
    Recorder recorder(OptionsFor(folder / "above/out"), MakeConfig(), Host());
    EXPECT_FALSE(folder.empty());
  }
  EXPECT_TRUE(folder.empty());
}

// Every write, fsync and rename in turn, on a new folder and on one to be replaced.
TEST(Recorder, EveryFailureOfTheDiskIsAnErrorThatLeavesNothing) {
  for (const bool replace : {false, true}) {
    const TemporaryFolder folder;
    if (replace) Record(OptionsFor(folder / "out"), 3);
    int calls = 0;
    for (int n = 1; n < 200; ++n) {
      fail_at = n;
      fail_error = n % 2 == 0 ? ENOSPC : EIO;
      std::string text;
      const int code = CodeOf([&] { Record(OptionsFor(folder / "out", true), 5); }, &text);
      const bool failed = fail_at <= 0;
      fail_at = 0;
      if (!failed) {
        EXPECT_EQ(code, 0) << text;
        calls = n - 1;
        break;
      }
      ASSERT_TRUE(code == 74) << "call " << n << ": " << code << ' ' << text;
      EXPECT_TRUE(text.starts_with((folder / "out").string())) << text;
      EXPECT_NE(text.find(n % 2 == 0 ? "No space left on device" : "Input/output error"),
                std::string::npos)
          << text;
      if (replace && fs::exists(folder / "out") && Lines(folder / "out/truth.csv").size() == 6) {
        // The last fsync, of the folder above: the new one is in its place, the old one beside it.
        EXPECT_NE(text.find("cannot sync"), std::string::npos) << text;
        for (const auto& entry : fs::directory_iterator(folder.path())) fs::remove_all(entry);
        Record(OptionsFor(folder / "out"), 3);
      } else if (replace) {
        EXPECT_EQ(FilesIn(folder.path()).size(), 16u) << "call " << n;
        EXPECT_EQ(Lines(folder / "out/truth.csv").size(), 4u);
      } else if (!folder.empty()) {
        EXPECT_EQ(FilesIn(folder.path()).size(), 16u) << "call " << n;
        fs::remove_all(folder / "out");
      }
    }
    EXPECT_GT(calls, 30);
  }
}

TEST(Recorder, ALimitOnTheFileSizeIsAnErrorNotTheEnd) {
  const TemporaryFolder folder;
  const int code = InChild([&] {
    const rlimit limit{2000, 2000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    Record(OptionsFor(folder / "out"));
  });
  EXPECT_EQ(code, 74);
  EXPECT_TRUE(folder.empty());
}

TEST(Recorder, AFolderThatCannotBeWrittenToIsRefused) {
  const TemporaryFolder folder;
  Host();  // a child without rights could not look for plugins
  fs::create_directories(folder / "mine");
  fs::permissions(folder.path(), fs::perms(0755));
  fs::permissions(folder / "mine", fs::perms(0555));
  const int code = InChild([&] {
    if (::getuid() == 0 && ::setuid(65534) != 0) ::_exit(99);
    Record(OptionsFor(folder / "mine/deep/out"));
  });
  if (code == 99) GTEST_SKIP() << "cannot give up the rights of root";
  EXPECT_EQ(code, 73);
  EXPECT_TRUE(fs::is_empty(folder / "mine"));
}

// FIPS 180-4, examples of NIST: one block, two blocks, and none.
TEST(Sha256, AgreesWithTheStandard) {
  EXPECT_EQ(internal::Sha256("abc"),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(internal::Sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(internal::Sha256(""),
            "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(internal::Sha256(std::string(1'000'000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

}  // namespace
}  // namespace alidade
