// SPDX-License-Identifier: Apache-2.0
//
// Tests those files of a run that contain landmarks.
#include "alidade/record/landmarks_file.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "alidade/compare/finished_run.h"
#include "alidade/experiment/map_metrics.h"
#include "alidade/model/landmark.h"
#include "alidade/record/landmarks_ply.h"
#include "support/landmark_models.h"
#include "support/recording.h"

namespace alidade::testing {
namespace {

/// A camera moves to the right past four points. A sensor measures the offsets of the points.
class Street : public Source {
 public:
  /// If `outlier` is true, one measurement of landmark 3 has a large error.
  explicit Street(bool outlier = false) : outlier_(outlier) {}
  const std::vector<StreamInfo>& streams() const override { return streams_; }
  const std::vector<StreamInfo>& truths() const override { return truths_; }
  bool Next(SourceFrame& frame) override {
    if (next_ == 20) return false;
    const double x = 0.1 * next_;
    std::vector<Observation> observations;
    for (int id = 0; id < 4; ++id) {
      const std::array<double, 3> p = *TrueLandmark(id);
      if (id == 3 && next_ < 10) continue;
      const double error_m = outlier_ && id == 3 && next_ == 15 ? 5.0 : 0.0;
      observations.push_back({id, {p[0] - x + error_m, p[1], p[2]}});
    }
    frame = {FrameOf(0.1 * next_, observations), {{x, 0.0, 0.0}}};
    ++next_;
    return true;
  }
  std::optional<std::array<double, 3>> TrueLandmark(std::int64_t id) const override {
    if (id > 3) return std::nullopt;
    const auto i = static_cast<double>(id);
    return std::array{1.0 + 0.5 * i, 0.3 * i * i, 2.0 - 0.1 * i};
  }

 private:
  std::vector<StreamInfo> streams_ = {{"tracks", 3}};
  std::vector<StreamInfo> truths_ = {{"cam.position", 3}};
  bool outlier_;
  int next_ = 0;
};

Experiment OnTheStreet(bool outlier = false) {
  Experiment experiment;
  experiment.source = std::make_unique<Street>(outlier);
  EstimatorSpec named;
  named.name = "ekf";
  named.type = "ekf";
  named.problem = MapSystem(Offset(0.05), {}, 0.1);
  EkfOptions options;
  if (outlier) options.gate = 0.9999;
  named.estimator = std::make_unique<Ekf>(named.problem, options, experiment.source->streams());
  experiment.estimators.push_back(std::move(named));
  return experiment;
}

TEST(LandmarkRecords, TheMapAtTheEndIsWritten) {
  const TemporaryFolder folder;
  Experiment experiment = OnTheStreet();
  Recorder recorder(OptionsFor(folder / "out"), MakeConfig());
  const RunResult result = RunInto(recorder, experiment);
  recorder.Finish(result);
  ASSERT_EQ(result.status, RunStatus::kOk) << result.reason;
  const std::vector<std::string> lines = Lines(folder / "out/ekf/landmarks.csv");
  ASSERT_EQ(lines.size(), 5u);
  EXPECT_EQ(lines[0],
            "id,generation,representation,x,y,z,sigma_x,sigma_y,sigma_z,inverse_distance,"
            "sigma_inverse_distance,first_s,last_s,tried,accepted,true_x,true_y,true_z,"
            "cov_xy,cov_xz,cov_yz,status,removed_s");
  const std::vector<std::string> last = Cells(lines[4]);
  ASSERT_EQ(last.size(), 23u);
  EXPECT_EQ(last[0], "3");
  EXPECT_EQ(last[2], "xyz");
  EXPECT_NEAR(std::stod(last[3]), 2.5, 3.0 * std::stod(last[6]));
  EXPECT_EQ(last[9], "");
  EXPECT_EQ(last[11], "1.000000000");
  EXPECT_EQ(last[13], "9");
  EXPECT_EQ(last[15] + ' ' + last[17], "2.5 1.7");
  const LandmarkEstimate estimate = experiment.estimators[0].estimator->landmarks()[3];
  EXPECT_DOUBLE_EQ(std::stod(last[6]), std::sqrt(estimate.covariance(0, 0)));
}

TEST(LandmarkRecords, EveryColumnOfTheMapIsItsOwn) {
  const TemporaryFolder folder;
  Experiment experiment = OnTheStreet(true);
  Recorder recorder(OptionsFor(folder / "out"), MakeConfig());
  recorder.Finish(RunInto(recorder, experiment));
  const std::vector<std::string> last = Cells(Lines(folder / "out/ekf/landmarks.csv").at(4));
  const LandmarkEstimate estimate = experiment.estimators[0].estimator->landmarks()[3];
  ASSERT_EQ(last.size(), 23u);
  EXPECT_EQ(last[0] + ' ' + last[1], "3 0");
  for (std::size_t i = 0; i < 3; ++i) {
    const auto e = static_cast<Eigen::Index>(i);
    EXPECT_DOUBLE_EQ(std::stod(last[3 + i]), estimate.position[e]);
    EXPECT_DOUBLE_EQ(std::stod(last[6 + i]), std::sqrt(estimate.covariance(e, e)));
  }
  EXPECT_EQ(last[9] + last[10], "");
  // The landmark is measured in frames 10 to 19. The first of these measurements initialises it.
  EXPECT_EQ(last[11], "1.000000000");
  EXPECT_EQ(last[12], "1.900000000");
  EXPECT_EQ(last[13], "9");
  EXPECT_EQ(last[14], "8");  // one of the 9 measurements was gated
  const std::array<double, 3> place = *Street().TrueLandmark(3);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(std::stod(last[15 + i]), place[i]);
  EXPECT_DOUBLE_EQ(std::stod(last[18]), estimate.covariance(0, 1));
  EXPECT_DOUBLE_EQ(std::stod(last[19]), estimate.covariance(0, 2));
  EXPECT_DOUBLE_EQ(std::stod(last[20]), estimate.covariance(1, 2));
  EXPECT_EQ(last[21] + last[22], "kept");
}

/// Landmark 0 is measured once, is removed, and is measured again later.
class Passing : public Street {
 public:
  bool Next(SourceFrame& frame) override {
    if (!Street::Next(frame)) return false;
    const bool seen = frame.timestamp == 0 || frame.timestamp > TimestampFromSeconds(1.05);
    if (!seen) {
      std::erase_if(frame.measurements, [](const Measurement& m) { return m.landmark == 0; });
    }
    return true;
  }
};

Experiment OfOneThatPasses() {
  Experiment experiment = OnTheStreet();
  EstimatorSpec& named = experiment.estimators[0];
  experiment.source = std::make_unique<Passing>();
  named.problem.landmarks->max_missed_frames = 3;
  named.estimator =
      std::make_unique<Ekf>(named.problem, EkfOptions{}, experiment.source->streams());
  return experiment;
}

TEST(LandmarkRecords, TheMapHasThoseThatWereRemoved) {
  const TemporaryFolder folder;
  Experiment experiment = OfOneThatPasses();
  Recorder recorder(OptionsFor(folder / "out"), MakeConfig());
  const RunResult result = RunInto(recorder, experiment);
  recorder.Finish(result);
  const std::vector<std::string> lines = Lines(folder / "out/ekf/landmarks.csv");
  ASSERT_EQ(lines.size(), 6u);  // the header, two generations of landmark 0, and landmarks 1 to 3
  const std::vector<std::string> before = Cells(lines[1]), after = Cells(lines[2]);
  EXPECT_EQ(before[0] + before[1] + before[21] + ' ' + before[22], "00removed 0.300000000");
  EXPECT_EQ(before[12], "0.000000000");
  EXPECT_NEAR(std::stod(before[3]), 1.0, 3.0 * std::stod(before[6]));
  EXPECT_EQ(before[15], "1");  // x of its true position
  EXPECT_EQ(after[0] + after[1] + after[21] + ' ' + after[22], "01kept ");
  EXPECT_EQ(after[11], "1.100000000");
  // The metrics of the map contain only the landmarks at the end. A reader of the folder obtains
  // the same map.
  const EstimatorResult& one = result.estimators.at(0);
  ASSERT_EQ(one.landmarks->size(), 4u);
  ASSERT_EQ(one.removed_landmarks.size(), 1u);
  EXPECT_EQ(one.metrics.at("map.rmse"), internal::MapMetrics(*one.landmarks).at("map.rmse"));
  const internal::ComparedRun read = internal::ReadRun(folder / "out");
  ASSERT_EQ(read.estimators.at(0).result.landmarks->size(), 4u);
  EXPECT_EQ(read.estimators[0].result.landmarks->front().generation, 1);
}

TEST(LandmarkRecords, PointsOfTheMapAreWrittenAsPly) {
  std::vector<LandmarkEstimate> map(3);  // the first landmark has no position
  for (std::size_t i = 1; i < 3; ++i) {
    map[i].id = 7;
    map[i].position = Eigen::Vector3d(1.5, -2.0, static_cast<double>(i));
    map[i].covariance = Eigen::Vector3d(0.25, 1.0, 4.0).asDiagonal();
  }
  map[1].removed = TimestampFromSeconds(0.5);
  EXPECT_EQ(internal::LandmarksPly(map),
            "ply\n"
            "format ascii 1.0\n"
            "comment landmarks in the world, m\n"
            "element vertex 2\n"
            "property double x\n"
            "property double y\n"
            "property double z\n"
            "property double sigma_x\n"
            "property double sigma_y\n"
            "property double sigma_z\n"
            "property uchar removed\n"
            "property double id\n"
            "end_header\n"
            "1.5 -2 1 0.5 1 2 1 7\n"
            "1.5 -2 2 0.5 1 2 0 7\n");
}

// If a landmark was seen along one ray only, its position is undetermined. The cells of the
// position are then empty, and only the inverse distance and its sigma are written.
TEST(LandmarkRecords, AnInverseDistanceIsWrittenBeforeItsSigma) {
  LandmarkEstimate far_off;
  far_off.id = 7;
  far_off.generation = 2;
  far_off.representation = LandmarkRepresentation::kInverseDepth;
  far_off.inverse_distance = -0.25;
  far_off.sigma = 0.5;
  const TemporaryFolder folder;
  internal::OutputFolder out(folder / "out", false);
  internal::RunColumns columns;
  internal::WriteLandmarks(out, "ekf", {far_off}, columns);
  out.Commit();
  EXPECT_EQ(Lines(folder / "out/ekf/landmarks.csv").at(1),
            "7,2,inverse_depth,,,,,,,-0.25,0.5,,,0,0,,,,,,,kept,");
}

TEST(LandmarkRecords, OtherFilesHaveTheBlocksOfTheSystemAlone) {
  const TemporaryFolder folder;
  Experiment experiment = OnTheStreet();
  Recorder recorder(OptionsFor(folder / "out"), MakeConfig());
  recorder.Finish(RunInto(recorder, experiment));
  EXPECT_EQ(Lines(folder / "out/ekf/estimates.csv")[0],
            "t_s,cam.position.x,cam.position.y,cam.position.z,sigma:cam.position.x,"
            "sigma:cam.position.y,sigma:cam.position.z");
  EXPECT_EQ(Lines(folder / "out/ekf/gains.csv"), std::vector<std::string>{"t_s,sensor"});
  EXPECT_EQ(Cells(Lines(folder / "out/ekf/innovations.csv")[1])[3], "0");
}

TEST(LandmarkRecords, ResultsHaveCountsAndTheMapsErrors) {
  Experiment experiment = OnTheStreet();
  const RunResult result = alidade::Run(experiment, {});
  const EstimatorResult& one = result.estimators.at(0);
  EXPECT_EQ(one.counts.at("initialised:tracks"), 4);
  EXPECT_EQ(one.counts.at("landmarks.initialised"), 4);
  EXPECT_EQ(one.counts.at("landmarks.deleted"), 0);
  EXPECT_TRUE(one.counts.contains("landmarks.converted"));
  EXPECT_TRUE(one.counts.contains("landmarks.negative"));
  for (const char* key : {"map.rmse", "map.sim3.rmse", "map.sim3.scale", "final_error:cam.position",
                          "nees.mean:cam"}) {
    EXPECT_TRUE(one.metrics.contains(key)) << key;
  }
  double sum = 0.0;
  for (const LandmarkEstimate& landmark : *one.landmarks) {
    const auto p = experiment.source->TrueLandmark(landmark.id);
    sum += (landmark.position - Eigen::Map<const Eigen::Vector3d>(p->data())).squaredNorm();
  }
  EXPECT_NEAR(one.metrics.at("map.rmse"), std::sqrt(sum / 4.0), 1e-12);
}

TEST(LandmarkRecords, TheReprojectionErrorOfEachFrameIsWritten) {
  const TemporaryFolder folder;
  Experiment experiment = OnTheStreet();
  Recorder recorder(OptionsFor(folder / "out"), MakeConfig());
  recorder.Finish(RunInto(recorder, experiment));
  // The expected RMS is computed from the rows of the last frame in innovations.csv, which has four
  // landmarks.
  const std::vector<std::string> innovations = Lines(folder / "out/ekf/innovations.csv");
  double sum = 0.0;
  for (std::size_t i = innovations.size() - 4; i < innovations.size(); ++i) {
    const std::vector<std::string> cells = Cells(innovations[i]);
    ASSERT_EQ(cells[0] + cells[4], "1.900000000accepted");
    for (std::size_t r = cells.size() - 3; r < cells.size(); ++r)
      sum += std::pow(std::stod(cells[r]), 2);
  }
  const std::vector<std::string> lines = Lines(folder / "out/ekf/reprojection.csv");
  EXPECT_EQ(lines[0], "t_s,sensor,landmarks,rms");
  // The file contains the header and 19 frames. The first frame only initialises the landmarks.
  EXPECT_EQ(lines.size(), 20u);
  const std::vector<std::string> last = Cells(lines.back());
  EXPECT_EQ(last[0] + last[1] + last[2], "1.900000000tracks4");
  EXPECT_NEAR(std::stod(last[3]), std::sqrt(sum / 12.0), 1e-12);
}

TEST(MapMetrics, ASimilarityIsNoErrorAfterAlignment) {
  const Street source;
  const Eigen::AngleAxisd turn(0.3, Eigen::Vector3d(1, 2, 3).normalized());
  std::vector<LandmarkEstimate> map;
  for (int id = 0; id < 4; ++id) {
    const auto p = source.TrueLandmark(id);
    LandmarkEstimate& one = map.emplace_back();
    one.id = id;
    one.true_position = Eigen::Map<const Eigen::Vector3d>(p->data());
    one.position = 2.0 * (turn * one.true_position) + Eigen::Vector3d(1.0, -2.0, 0.5);
  }
  map.emplace_back().id = 77;  // the true position of this landmark is unknown
  map.back().position = Eigen::Vector3d(9, 9, 9);
  const auto metrics = internal::MapMetrics(map);
  EXPECT_GT(metrics.at("map.rmse"), 1.0);
  EXPECT_LT(metrics.at("map.sim3.rmse"), 1e-12);
  EXPECT_NEAR(metrics.at("map.sim3.scale"), 0.5, 1e-12);
}

TEST(MapMetrics, PointsOnALineHaveAScaleThoseAtOnePlaceNone) {
  std::vector<LandmarkEstimate> map(3);
  for (int id = 0; id < 3; ++id) {
    LandmarkEstimate& one = map[static_cast<std::size_t>(id)];
    one.id = id;
    one.true_position = Eigen::Vector3d(1.0, 2.0, 3.0) + 0.5 * id * Eigen::Vector3d(2, -1, 2);
    one.position = Eigen::Vector3d(id, 0.0, 0.0);
  }
  auto metrics = internal::MapMetrics(map);
  EXPECT_NEAR(metrics.at("map.sim3.scale"), 1.5, 1e-12);
  EXPECT_LT(metrics.at("map.sim3.rmse"), 1e-12);
  for (LandmarkEstimate& one : map) one.position = Eigen::Vector3d(0.1, 0.2, 0.3);
  metrics = internal::MapMetrics(map);
  EXPECT_TRUE(metrics.contains("map.rmse"));
  EXPECT_FALSE(metrics.contains("map.sim3.rmse"));
}

}  // namespace
}  // namespace alidade::testing
