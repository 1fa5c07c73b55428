// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/recorder.h"

#include <gtest/gtest.h>

#include <cmath>

#include "alidade/base/number_text.h"
#include "alidade/io/sha256.h"
#include "alidade/replay/replay.h"
#include "alidade/replay/run_inputs.h"
#include "sensors/stereo_disparity.h"
#include "support/recording.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

TEST(Recorder, WritesEveryFile) {
  const TemporaryFolder folder;
  Record(OptionsFor(folder / "above" / "out"));
  EXPECT_EQ(FilesIn(folder / "above" / "out"),
            (std::vector<std::string>{"alone/errors.csv",
                                      "alone/estimates.csv",
                                      "alone/events.csv",
                                      "alone/final_covariance.csv",
                                      "alone/gains.csv",
                                      "alone/innovations.csv",
                                      "columns.json",
                                      "comparison.csv",
                                      "config.resolved.yaml",
                                      "ekf/errors.csv",
                                      "ekf/estimates.csv",
                                      "ekf/events.csv",
                                      "ekf/final_covariance.csv",
                                      "ekf/gains.csv",
                                      "ekf/innovations.csv",
                                      "expected.csv",
                                      "files.txt",
                                      "implied_states.csv",
                                      "log.txt",
                                      "measurements.csv",
                                      "report.html",
                                      "run.json",
                                      "timing.csv",
                                      "timing.json",
                                      "truth.csv"}));
  // There are no files outside the folder of the run.
  EXPECT_EQ(FilesIn(folder.path()).size(), 25u);
}

TEST(Recorder, ColumnsJsonHasTheHeaderOfEveryCsvFile) {
  const TemporaryFolder folder;
  Record(OptionsFor(folder / "out"));
  const Config columns = Config::FromText(Read(folder / "out/columns.json"), "columns.json");
  std::size_t files = 0;
  for (const std::string& file : FilesIn(folder / "out")) {
    if (!file.ends_with(".csv") || file == "comparison.csv") continue;
    ++files;
    std::vector<std::string> names;
    for (const Node& column : columns.root().At(file).Items()) {
      names.push_back(column.At("name").Text());
    }
    EXPECT_EQ(names, Cells(Lines(folder / "out" / file).at(0))) << file;
  }
  EXPECT_EQ(files, columns.root().Entries().size());
  const Node sigma = columns.root().At("ekf/estimates.csv").Items().at(2);
  EXPECT_EQ(sigma.At("name").Text(), "sigma:target.depth");
  EXPECT_EQ(sigma.At("unit").Text(), "m");
  EXPECT_EQ(sigma.At("quantity").Text(), "sigma");
  EXPECT_EQ(sigma.At("subject").Text(), "target.depth");
}

TEST(Recorder, EstimatesRoundTrip) {
  const TemporaryFolder folder;
  Experiment experiment = MakeExperiment();
  Recorder recorder(OptionsFor(folder / "out"), MakeConfig());
  recorder.Finish(RunInto(recorder, experiment));
  const std::vector<std::string> lines = Lines(folder / "out/ekf/estimates.csv");
  ASSERT_EQ(lines.size(), 61u);
  EXPECT_EQ(lines[0],
            "t_s,target.depth,sigma:target.depth,target.depth_rate,sigma:target.depth_rate,"
            "template.inverse_distance,sigma:template.inverse_distance");
  const std::vector<std::string> last = Cells(lines[60]);
  ASSERT_EQ(last.size(), 7u);
  EXPECT_EQ(last[0], "1.947000000");
  const State& state = experiment.estimators[0].estimator->state();
  for (int id = 0; id < 3; ++id) {
    EXPECT_EQ(last[1 + 2 * id], internal::NumberText(*state.value(id)));
    EXPECT_EQ(last[2 + 2 * id], internal::NumberText(std::sqrt(state.covariance().Variance(id))));
  }
}

TEST(Recorder, KeepsMeasurementsAndTruthAsTheyCame) {
  const TemporaryFolder folder;
  Record(OptionsFor(folder / "out"));
  SwingingTarget source(60);
  SourceFrame frame;
  std::vector<std::string> measurements = {"t_s,stream,landmark,v0"}, truth = {"t_s,depth"};
  while (source.Next(frame)) {
    std::string t;
    internal::AppendSeconds(t, frame.timestamp);
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
  SourceFrame frame;
  ASSERT_TRUE(source.Next(frame));
  const std::vector<std::string> lines = Lines(folder / "out/implied_states.csv");
  // Only the disparity implies a state. A scale alone does not determine a distance.
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_EQ(lines[0], "t_s,sensor,target.depth");
  EXPECT_EQ(lines[1], "0.000000000,disparity," +
                          internal::NumberText(400.0 * 0.065 / frame.measurements[1].values[0]));
}

/// An estimator for a report that the test constructs.
class NoEstimator : public Estimator {
 public:
  void Start(Timestamp) override {}
  const UpdateReport& Process(const Frame&) override { return report_; }
  const State& state() const override { return state_; }
  Timestamp timestamp() const override { return kNoTimestamp; }
  bool diverged() const override { return false; }
  bool failed() const override { return false; }

 private:
  State state_;
  UpdateReport report_;
};

/// A constructed report of one update. One block still waits for its initial value, and another
/// block is fixed.
struct HandMade {
  Experiment experiment;
  State state;
  SourceFrame frame;
  UpdateReport report;

  HandMade() {
    experiment.source = std::make_unique<SwingingTarget>(1);
    EstimatorSpec named;
    named.name = "hand";
    named.type = "fake";
    named.estimator = std::make_unique<NoEstimator>();
    StateLayout& layout = named.problem.layout;
    const Space scalar{"x", "m", "", {""}, Geometry::Vector(1)};
    layout.Declare("a.waits", "a", scalar);
    layout.Declare("a.fixed", "a", scalar, BlockStatus::kConstant);
    layout.Declare("a.attitude", "a",
                   {"q", "rad", "", {"w", "x", "y", "z"}, Geometry::UnitQuaternion()});
    testing::AddSensor(named.problem, "disparity",
                       MakeSensor(StereoDisparity(400.0, 0.065, 1.0, 0.3), "stereo_disparity"),
                       {"a.waits"});
    state = State(layout);
    const double fixed = 0.25, attitude[4] = {1.0, 0.0, 0.0, 0.0};
    state.Add(1, &fixed, Eigen::MatrixXd());
    state.Add(2, attitude, Eigen::Vector3d(1.0, 4.0, 9.0).asDiagonal().toDenseMatrix());
    experiment.estimators.push_back(std::move(named));
    static_cast<Frame&>(frame) =
        // The disparity belongs to 0.289 m, which is below the range of the stereo sensor.
        testing::FrameAt(5e-9, {{0, 90.0}});
    MeasurementReport accepted;
    accepted.sensor = 0;
    accepted.dof = 1;
    accepted.nis = 0.5;
    accepted.z = report.Copy(std::vector{80.0});
    accepted.h = report.Copy(std::vector{79.0});
    accepted.innovation = report.Copy(std::vector{1.0});
    accepted.s = report.Copy(std::vector{2.25});
    accepted.gain = report.Copy(std::vector{0.1, 0.0, -0.3});
    MeasurementReport invalid;
    invalid.sensor = 0;
    invalid.dof = 1;
    invalid.landmark = 17;
    invalid.outcome = Outcome::kInvalid;
    invalid.z = report.Copy(std::vector{-1.0});
    report.Add() = accepted;
    report.Add() = invalid;
  }
};

TEST(Recorder, WritesAbsentFixedAndRejected) {
  const TemporaryFolder folder;
  HandMade hand;
  Recorder recorder(OptionsFor(folder / "out"), MakeConfig());
  recorder.Begin(hand.experiment);
  recorder.OnFrame(hand.frame);
  recorder.OnEstimate(0, hand.frame, hand.state, hand.report);
  RunResult result;
  result.estimators.resize(1);
  result.estimators[0].name = "hand";
  recorder.Finish(result);
  EXPECT_EQ(
      Read(folder / "out/hand/estimates.csv"),
      "t_s,a.waits,sigma:a.waits,a.fixed,sigma:a.fixed,a.attitude.w,a.attitude.x,a.attitude.y,"
      "a.attitude.z,sigma:a.attitude.rx,sigma:a.attitude.ry,sigma:a.attitude.rz\n"
      "0.000000005,,,0.25,,1,0,0,0,1,2,3\n");
  EXPECT_EQ(Read(folder / "out/hand/innovations.csv"),
            "t_s,stream,sensor,landmark,outcome,dof,nis,log_det_s,z0,h0,s0,r0\n"
            "0.000000005,disparity,disparity,,accepted,1,0.5,0.8109302162163288,80,79,1.5,1\n"
            "0.000000005,disparity,disparity,17,invalid,1,,,-1,,,\n");
  EXPECT_EQ(Read(folder / "out/hand/gains.csv"),
            "t_s,sensor,a.waits<-disparity,a.attitude.rx<-disparity,a.attitude.ry<-disparity,"
            "a.attitude.rz<-disparity\n"
            "0.000000005,disparity,,0.1,0,-0.3\n");
  EXPECT_EQ(Read(folder / "out/implied_states.csv"),
            "t_s,sensor,a.waits\n");  // an invalid measurement implies no state
}

TEST(Recorder, AFrameOlderThanTheStateHasNoEstimate) {
  const TemporaryFolder folder;
  Experiment experiment = MakeExperiment(6);  // the frames are 33 ms apart
  EstimatorSpec& ekf = experiment.estimators[0];
  ekf.problem.initial_time_s = 0.066;
  ekf.estimator = std::make_unique<Ekf>(ekf.problem, EkfOptions{}, experiment.source->streams());
  Recorder recorder(OptionsFor(folder / "out"), MakeConfig());
  recorder.Finish(RunInto(recorder, experiment));
  std::vector<std::string> timestamps;
  for (const std::string& line : Lines(folder / "out/ekf/estimates.csv")) {
    timestamps.push_back(Cells(line)[0]);
  }
  EXPECT_EQ(timestamps, (std::vector<std::string>{"t_s", "0.066000000", "0.099000000",
                                                  "0.132000000", "0.165000000"}));
  // The disparity is 26 px m divided by 0.3 m.
  EXPECT_EQ(Lines(folder / "out/ekf/innovations.csv")[1].substr(0, 46),
            "0.000000000,disparity,disparity,,stale,1,,,86.");
}

TEST(Recorder, QuotesTextsInEvents) {
  const TemporaryFolder folder;
  Record(OptionsFor(folder / "out"));
  const std::string events = Read(folder / "out/ekf/events.csv");
  EXPECT_TRUE(events.starts_with("t_s,kind,text\n")) << events;
  EXPECT_TRUE(
      events.ends_with("\n0.033000000,estimator_specific,\"a \"\"word\"\", "
                       "and\nanother\"\n,estimator_specific,timeless\n"))
      << events;
}

TEST(Recorder, TellsPluginsOfOneNameApart) {
  const TemporaryFolder folder;
  std::string expected = "\"plugins\": [";
  std::vector<fs::path> plugins;
  // The order of the plugins is kept; it is not the order of the folders' names.
  for (const char* where : {"b", "a"}) {
    fs::create_directory(folder / where);
    const fs::path plugin = folder / where / "models.so";
    std::ofstream(plugin) << "bytes of " << where;
    plugins.push_back(plugin);
    expected.append(expected.back() == '[' ? "" : ",")
        .append("\n    {\n      \"file\": \"models.so\",\n      \"sha256\": \"")
        .append(internal::Sha256OfFile(plugin))
        .append("\"\n    }");
  }
  Recorder::Options options = OptionsFor(folder / "out");
  options.plugins = internal::HashFiles(plugins);
  Recorder recorder(options, MakeConfig());
  recorder.Begin(MakeExperiment());
  recorder.Finish({});
  const std::string json = Read(folder / "out/run.json");
  EXPECT_NE(json.find(expected + "\n  ]"), std::string::npos) << json;
}

TEST(Recorder, RunJsonHasTheAgreedKeys) {
  const TemporaryFolder folder;
  RunResult result;
  result.status = RunStatus::kFailed;
  result.reason = "it \"broke\"";
  result.frames = 7;
  EstimatorResult one;
  one.name = one.type = "ekf";
  one.sensors = {"disparity", "inverse_scale"};
  one.metrics = {{"rmse:target.depth", 0.00195}, {"final_error:target.depth", INFINITY}};
  one.counts = {{"accepted:stereo", 151}};
  one.units = {{"target.depth", "m"}};
  one.diverged = true;
  one.events = {{0, EventKind::kRejectionRecovery, ""},
                {1, EventKind::kRejectionRecovery, ""},
                {2, EventKind::kDiverged, ""}};
  one.unobservable = {{"a.x", "b.y"}};
  result.estimators = {one};
  Recorder recorder(OptionsFor(folder / "out"), MakeConfig());
  const Experiment experiment = MakeExperiment();
  recorder.Begin(experiment);
  recorder.Finish(result);
  EXPECT_EQ(Read(folder / "out/run.json"), R"({
  "status": "failed",
  "reason": "it \"broke\"",
  "versions": {
    "alidade": "0.1.0"
  },
  "seed": 42,
  "frames": 7,
  "data": {
    "measurements": "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"
  },
  "verdict": "not tested",
  "reference": "truth",
  "conclusions": [],
  "plugins": [],
  "estimators": {
    "ekf": {
      "type": "ekf",
      "kind": "filter",
      "sensors": [
        "disparity",
        "inverse_scale"
      ],
      "smoothed": false,
      "blocks": [
        {
          "name": "target.depth",
          "unit": "m",
          "geometry": "vector",
          "size": 1
        },
        {
          "name": "target.depth_rate",
          "unit": "m/s",
          "geometry": "vector",
          "size": 1
        },
        {
          "name": "template.inverse_distance",
          "unit": "1/m",
          "geometry": "vector",
          "size": 1
        }
      ],
      "rows": 0,
      "innovations": {
        "disparity": {
          "units": [
            "px"
          ],
          "z_index": [
            0
          ],
          "is_angle": [
            false
          ],
          "robust_loss": false,
          "landmark_prior": false
        },
        "inverse_scale": {
          "units": [
            ""
          ],
          "z_index": [
            0
          ],
          "is_angle": [
            false
          ],
          "robust_loss": false,
          "landmark_prior": false
        }
      },
      "failed": false,
      "metrics": {
        "final_error:target.depth": null,
        "rmse:target.depth": 0.00195,
        "diverged": true
      },
      "verdict": {
        "state": "not tested",
        "because": "",
        "since_s": null,
        "basis": "none"
      },
      "diagnosis": [],
      "counts": {
        "accepted:stereo": 151
      },
      "units": {
        "target.depth": "m"
      },
      "events": {
        "diverged": 1,
        "rejection_recovery": 2
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
  EXPECT_EQ(
      Read(folder / "out/comparison.csv"),
      "metric,ekf\nrmse:target.depth,0.00195\nfinal_error:target.depth,inf\naccepted:stereo,151\n"
      "verdict,not tested\n");
}

TEST(Recorder, SaysWhatFailedBeforeTheExperimentWasKnown) {
  const TemporaryFolder folder;
  Recorder recorder(OptionsFor(folder / "out"), MakeConfig());
  RunResult result;
  result.status = RunStatus::kStopped;
  recorder.Finish(result);
  EXPECT_NE(Read(folder / "out/run.json").find("\"status\": \"stopped\""), std::string::npos);
}

TEST(Recorder, SameRunGivesSameBytes) {
  const TemporaryFolder folder;
  Record(OptionsFor(folder / "one"));
  Record(OptionsFor(folder / "another"));
  const std::vector<std::string> files = FilesIn(folder / "one");
  EXPECT_EQ(files, FilesIn(folder / "another"));
  for (const std::string& file : files) {
    if (internal::HasWallClock(file)) continue;
    EXPECT_EQ(Read(folder / "one" / file), Read(folder / "another" / file)) << file;
  }
}

}  // namespace
}  // namespace alidade
