// SPDX-License-Identifier: Apache-2.0
//
// Tests control inputs from a config. All estimators run tests/plugins/driven/config.yaml on one
// table.
#include <algorithm>
#include <cmath>
#include <sstream>

#include "alidade/check/check.h"
#include "alidade/check/explain.h"
#include "alidade/experiment/run.h"
#include "alidade/replay/replay.h"
#include "plugins/host/host_fixture.h"
#include "support/recording.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFolder = ALIDADE_SOURCE_DIR "/tests/plugins/driven";

struct Gaussian {
  double x, p;
};

/// Returns the estimates of the Kalman filter or of the smoother for drive.csv, computed here.
/// There is no speed before 0.5 s. Each speed acts until the next speed arrives. Only the speed of
/// 2.5 s ends earlier, at 4 s, because its timeout is 1.5 s.
std::vector<Gaussian> WrittenOut(bool smoothed) {
  struct Row {
    double t_s, distance, fix;  // distance since the previous row, m; fix, m, or 0
  };
  const std::vector<Row> rows = {
      {0.0, 0.0, 1.2},       {0.5, 0.0, 0.0},        {1.0, 2.0 * 0.5, 2.3}, {1.7, 1.5 * 0.7, 0.0},
      {2.0, 1.5 * 0.3, 3.1}, {2.5, -1.0 * 0.5, 0.0}, {3.0, 0.5 * 0.5, 3.6}, {6.0, 0.5 * 1.0, 3.5},
      {6.5, 0.0, 4.2},       {7.0, 1.0 * 0.5, 4.3}};
  std::vector<Gaussian> predicted, filtered;
  Gaussian now{1.0, 0.25};
  double t_s = 0.0;
  for (const Row& row : rows) {
    now = {now.x + row.distance, now.p + 0.04 * (row.t_s - t_s)};
    t_s = row.t_s;
    predicted.push_back(now);
    if (row.fix != 0.0) {
      const double gain = now.p / (now.p + 0.09);
      now = {now.x + gain * (row.fix - now.x), (1.0 - gain) * now.p};
    }
    filtered.push_back(now);
  }
  for (std::size_t k = rows.size() - 1; smoothed && k-- > 0;) {
    const double c = filtered[k].p / predicted[k + 1].p;
    filtered[k].x += c * (filtered[k + 1].x - predicted[k + 1].x);
    filtered[k].p += c * c * (filtered[k + 1].p - predicted[k + 1].p);
  }
  return filtered;
}

class DrivenTest : public HostTest {
 protected:
  static Config Read(const std::vector<std::pair<std::string, std::string>>& settings = {}) {
    Config config = Config::FromFile(fs::path(kFolder) / "config.yaml");
    for (const auto& [key, value] : settings) config.Set(key, value, "--set");
    return config;
  }
  RunResult RunInto(const Config& config, const fs::path& folder) {
    Experiment experiment = BuildExperiment(config, host_);
    Recorder recorder(testing::OptionsFor(folder), config);
    RunResult result = testing::RunInto(recorder, experiment);
    recorder.Finish(result);
    return result;
  }
  /// Sets `key` of the config to `value`, and returns the first line of the resulting error.
  std::string Refusal(const std::string& key, const std::string& value) {
    std::string text;
    const Config config = Read({{key, value}});
    EXPECT_EQ(testing::CodeOf([&] { BuildExperiment(config, host_); }, &text), 78) << value;
    const std::string file = (fs::path(kFolder) / "config.yaml").string();
    if (text.starts_with(file)) text = text.substr(file.size());
    return text;
  }
  PluginHost host_{{Built("driven")}};
};

TEST_F(DrivenTest, EveryEstimatorIsDrivenAsTheKalmanFilterWrittenOut) {
  for (const char* max_dt_s : {"1e6", "0.1"}) {
    std::vector<std::pair<std::string, std::string>> settings;
    for (const char* name : {"ekf", "iekf", "root", "ukf", "rts", "batch", "full"}) {
      settings.emplace_back("estimators." + std::string(name) + ".max_dt_s", max_dt_s);
    }
    const fs::path folder = folder_ / max_dt_s;
    const RunResult run = RunInto(Read(settings), folder);
    ASSERT_EQ(run.status, RunStatus::kOk) << run.reason;
    ASSERT_EQ(run.estimators.size(), 7u);
    for (const EstimatorResult& one : run.estimators) {
      const std::vector<Gaussian> expected = WrittenOut(one.name == "rts" || one.name == "batch");
      const auto lines = testing::Lines(folder / one.name / "estimates.csv");
      ASSERT_EQ(lines.size(), expected.size() + 1) << one.name;
      EXPECT_EQ(lines[0], "t_s,car.position,sigma:car.position");
      for (std::size_t k = 0; k < expected.size(); ++k) {
        const auto cells = testing::Cells(lines[k + 1]);
        EXPECT_NEAR(std::stod(cells[1]), expected[k].x, 1e-9) << one.name << k;
        EXPECT_NEAR(std::stod(cells[2]), std::sqrt(expected[k].p), 1e-9) << one.name << k;
      }
      // A control input has no innovation, but it is counted.
      EXPECT_EQ(testing::Lines(folder / one.name / "innovations.csv").size(), 8u) << one.name;
      EXPECT_EQ(one.counts.at("inputs:car"), 6) << one.name;
      EXPECT_EQ(one.counts.at("accepted:gps"), 7) << one.name;
      EXPECT_EQ(one.counts.at("input_stale"), 2) << one.name;
      EXPECT_EQ(one.counts.size(), 3u) << one.name;
      const auto count = [&](EventKind kind) {
        return std::ranges::count(one.events, kind, &Event::kind);
      };
      EXPECT_EQ(count(EventKind::kInputStale), 2) << one.name;
      EXPECT_EQ(count(EventKind::kUnused), 0) << one.name;
      EXPECT_EQ(count(EventKind::kSubsteps), std::string(max_dt_s) == "0.1" ? 3 : 0) << one.name;
    }
    const std::string json = testing::Read(folder / "run.json");
    EXPECT_NE(json.find("\"inputs:car\": 6"), std::string::npos) << json;
  }
}

// No sensor measures the odometry, so a filter neither accepts nor rejects it.
TEST_F(DrivenTest, WhatAFilterAcceptedComesWithAllInputs) {
  const RunResult run =
      RunInto(Read({{"estimators",
                     "{ekf: {type: ekf}, same: {type: ekf, use: {accepted_by: ekf}}, batch: {type: "
                     "ceres_batch, use: {accepted_by: ekf}}, lag: {type: fixed_lag, lag_s: "
                     "0.5}}"}}),
              folder_ / "run");
  ASSERT_EQ(run.status, RunStatus::kOk) << run.reason;
  for (const EstimatorResult& one : run.estimators) {
    const std::vector<Gaussian> expected = WrittenOut(one.name == "batch");
    const auto lines = testing::Lines(folder_ / "run" / one.name / "estimates.csv");
    ASSERT_EQ(lines.size(), expected.size() + 1) << one.name;
    for (std::size_t k = 0; k < expected.size(); ++k) {
      EXPECT_NEAR(std::stod(testing::Cells(lines[k + 1])[1]), expected[k].x, 1e-9) << one.name << k;
    }
    EXPECT_EQ(one.counts.at("inputs:car"), 6) << one.name;
  }
}

TEST_F(DrivenTest, AStreamThatTheLenderMeasuresIsNoInputOfTheFollower) {
  EXPECT_EQ(Refusal("estimators",
                    "{ekf: {type: ekf}, same: {type: ekf, use: {accepted_by: ekf}, overrides: "
                    "{state: {car: {input: {stream: gps}}}}}}"),
            "--set estimators.same.use.accepted_by: stream 'gps' is the control input of 'car' and "
            "also the stream of sensor 'gps' of 'ekf', so measurements that 'ekf' rejects would be "
            "missing as inputs; expected a filter without a sensor on that stream");
}

// The stream of a control input must not belong to a sensor of any filter in the chain of
// `accepted_by`.
TEST_F(DrivenTest, NorIsAStreamThatAnyLenderOnTheWayMeasures) {
  const Config config = Read(
      {{"source.streams", "{gps: gps_m, odometry: speed_m_s, none: {columns: [gps_m]}}"},
       {"sensors.other",
        "{model: fix, stream: none, roles: {position: car.position}, sigma_m: 0.3}"},
       {"estimators",
        "{a: {type: ekf}, b: {type: ekf, sensors: [other], use: {accepted_by: a}}, c: {type: ekf, "
        "sensors: [other], use: {accepted_by: b}, overrides: {state: {car: {input: {stream: "
        "gps}}}}}}"}});
  std::string text;
  EXPECT_EQ(testing::CodeOf([&] { BuildExperiment(config, host_); }, &text), 78);
  EXPECT_NE(text.find("estimators.c.use.accepted_by: stream 'gps' is the control input of 'car' "
                      "and also the stream of sensor 'gps' of 'a'"),
            std::string::npos)
      << text;
}

TEST_F(DrivenTest, ASensorOfTheNameOfAnEntryIsStillToldUnused) {
  const RunResult run =
      RunInto(Read({{"sensors",
                     "{car: {model: fix, stream: none, roles: {position: car.position}, "
                     "sigma_m: 0.3}}"},
                    {"source.streams", "{none: {columns: [gps_m]}, odometry: speed_m_s}"},
                    {"source.missing", "['', '1.2', '2.3', '3.1', '3.6', '3.5', '4.2', '4.3']"},
                    {"source.truth", "{}"},
                    {"estimators", "{ekf: {type: ekf}}"}}),
              folder_ / "run");
  ASSERT_EQ(run.status, RunStatus::kOk) << run.reason;
  const std::vector<Event>& events = run.estimators[0].events;
  const auto unused = std::ranges::find(events, EventKind::kUnused, &Event::kind);
  ASSERT_NE(unused, events.end());
  EXPECT_EQ(unused->text, "sensor 'car': stream 'none' had no measurement");
}

TEST_F(DrivenTest, FramesThatComeLateGiveTheBytesOfThoseInOrder) {
  // The batch with `mode: filtering` cannot process late frames.
  const std::string estimators =
      "{ekf: {type: ekf}, iekf: {type: iekf}, root: {type: square_root_ekf}, ukf: {type: ukf}, "
      "rts: {type: rts}, batch: {type: ceres_batch}}";
  const RunResult in_order = RunInto(Read({{"estimators", estimators}}), folder_ / "in_order");
  ASSERT_EQ(in_order.status, RunStatus::kOk) << in_order.reason;
  const auto lines = testing::Lines(fs::path(kFolder) / "drive.csv");
  std::ofstream late(folder_ / "late.csv");
  for (const std::size_t k : {0, 1, 3, 2, 5, 6, 4, 7, 10, 9, 8}) late << lines[k] << '\n';
  late.close();
  for (const std::string order : {"buffer", "rollback"}) {
    const RunResult run =
        RunInto(Read({{"estimators", estimators},
                      {"source.path", (folder_ / "late.csv").string()},
                      {"out_of_sequence", "{policy: " + order + ", window_s: 1}"}}),
                folder_ / order);
    ASSERT_EQ(run.status, RunStatus::kOk) << run.reason;
    EXPECT_EQ(run.arrivals.out_of_sequence, 4);
    EXPECT_EQ(run.arrivals.dropped, 0);
    for (const std::string& file : testing::FilesIn(folder_ / "in_order")) {
      if (internal::HasWallClock(file)) continue;
      if (file == "config.resolved.yaml" || file == "report.html") continue;
      EXPECT_EQ(testing::Read(folder_ / "in_order" / file), testing::Read(folder_ / order / file))
          << order << ' ' << file;
    }
  }
}

// The fixes are in a file of their own, and each row is 0.7 s late.
TEST_F(DrivenTest, ADelayedStreamGivesTheBytesOfItsOwnTimes) {
  const std::string estimators =
      "{ekf: {type: ekf}, iekf: {type: iekf}, root: {type: square_root_ekf}, ukf: {type: ukf}, "
      "rts: {type: rts}, batch: {type: ceres_batch}}";
  const RunResult in_order = RunInto(Read({{"estimators", estimators}}), folder_ / "in_order");
  ASSERT_EQ(in_order.status, RunStatus::kOk) << in_order.reason;
  const fs::path drive = fs::path(kFolder) / "drive.csv";
  std::ofstream late(folder_ / "fixes.csv");
  late << "t_s,gps_m\n";
  for (const std::string& line : testing::Lines(drive)) {
    const auto cells = testing::Cells(line);
    if (cells[0] != "t_s") late << std::stod(cells[0]) + 0.7 << ',' << cells[2] << '\n';
  }
  late.close();
  const std::string source = "{type: tables, path: " + folder_.path().string() +
                             ", files: [{path: fixes.csv, streams: {gps: {columns: gps_m, "
                             "delay_s: 0.7}}}, {path: " +
                             drive.string() +
                             ", streams: {odometry: speed_m_s}, truth: {position: true_m}}]}";
  for (const std::string order : {"reject", "buffer", "rollback"}) {
    const std::string window = order == "reject" ? "" : ", window_s: 1";
    const RunResult run = RunInto(Read({{"estimators", estimators},
                                        {"source", source},
                                        {"out_of_sequence", "{policy: " + order + window + "}"}}),
                                  folder_ / order);
    ASSERT_EQ(run.status, RunStatus::kOk) << run.reason;
    EXPECT_EQ(run.arrivals.out_of_sequence > 0, order != "reject");
    EXPECT_EQ(run.arrivals.dropped, 0);
    for (const std::string& file : testing::FilesIn(folder_ / "in_order")) {
      if (internal::HasWallClock(file)) continue;
      if (file == "config.resolved.yaml" || file == "report.html") continue;
      EXPECT_EQ(testing::Read(folder_ / "in_order" / file), testing::Read(folder_ / order / file))
          << order << ' ' << file;
    }
  }
}

TEST_F(DrivenTest, WhatIsNotAnInputIsRefusedWithItsPlace) {
  EXPECT_EQ(Refusal("state.car.input.stream", "odometri"),
            "--set state.car.input.stream: the source has no stream 'odometri'; expected one of "
            "gps, odometry; did you mean 'odometry'?");
  EXPECT_EQ(
      Refusal("source.streams.odometry", "[speed_m_s, gps_m]"),
      ":4:40 state.car.input.stream: stream 'odometry' has 2 values per measurement; expected 1, "
      "the size of the control input 'speed' of model 'driven'");
  EXPECT_EQ(Refusal("state.car", "{model: driven, noise: {speed: 0.2}, initial: {}}"),
            "--set state.car.input: missing key, needed by the control input speed of model "
            "driven; expected input: {stream: NAME}");
  EXPECT_EQ(Refusal("state.car.input", "odometry"),
            "--set state.car.input: 'odometry'; expected a map, as in {stream: NAME}, or {stream: "
            "NAME, timeout_s: S}");
  EXPECT_EQ(Refusal("state.car.input", "{timeout_s: 1}"),
            "--set state.car.input.stream: missing key, needed by the control input speed of "
            "model driven");
  EXPECT_EQ(Refusal("state.car.input.timeout_s", "0"),
            "--set state.car.input.timeout_s: '0' is out of range; expected a number in (0, "
            "1e+09]");
  EXPECT_EQ(Refusal("state.car.input.timeout", "1"),
            "--set state.car.input.timeout: unknown key; did you mean 'timeout_s'?");
  EXPECT_EQ(Refusal("state.car.inputs", "{odom: odometry}"),
            "--set state.car.inputs: unknown key; did you mean 'input'?");
  EXPECT_EQ(Refusal("state.other", "{model: constant, input: {stream: odometry}, initial: {}}"),
            "--set state.other.input: model 'constant' has no control input; remove this "
            "key");
  EXPECT_EQ(Refusal("estimators.ekf.overrides", "{state: {car: {input: {stream: gsp}}}}"),
            "--set estimators.ekf.overrides.state.car.input.stream: the source has no stream "
            "'gsp'; expected one of gps, odometry; did you mean 'gps'?");
}

TEST_F(DrivenTest, ExplainShowsWhereTheInputComesFrom) {
  const Config config = Read();
  const Experiment experiment = BuildExperiment(config, host_);
  const std::string text = Explain(config, experiment);
  for (const char* words : {"control input", "speed <- odometry, up to 1.5 s old", "car (input)",
                            "control inputs; jacobian_at prediction"}) {
    EXPECT_NE(text.find(words), std::string::npos) << words << "\n" << text;
  }
  EXPECT_EQ(text.find("Not supported: control inputs"), std::string::npos);
}

TEST_F(DrivenTest, TheModelPassesTheChecker) {
  for (const CheckResult& finding :
       CheckModel(FindModels(host_, Built("driven").string(), "driven").at(0),
                  Config::FromText("noise: {speed: 0.2}", "driven").root(), {})) {
    EXPECT_NE(finding.verdict, CheckResult::Verdict::kFail) << finding.check << ' ' << finding.text;
  }
}

}  // namespace
}  // namespace alidade
