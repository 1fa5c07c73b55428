// SPDX-License-Identifier: Apache-2.0
//
// Tests the fixed-lag smoother. Compares it with the batch, with the Kalman filter, and with its
// own estimates before frames leave the window.
#include <cmath>

#include "alidade/experiment/run.h"
#include "batch_fixture.h"
#include "support/manifold_models.h"

namespace alidade {
namespace {

using testing::AddSensor;
using testing::FrameAt;
using testing::MakeBatch;
using testing::MakeFixedLag;
using testing::Shipped;

/// Estimate of one frame.
struct Estimate {
  std::vector<double> x;
  Eigen::MatrixXd p;
};

/// Returns the estimate of all blocks that have a value, in the order of the layout. Unused rows of
/// the state are omitted.
Estimate EstimateOf(const State& state) {
  Estimate estimate;
  std::vector<int> rows;
  for (std::size_t id = 0; id < state.layout().blocks().size(); ++id) {
    const Block& block = state.layout().blocks()[id];
    if (!block.present) continue;
    const double* const value = state.value(static_cast<BlockId>(id));
    estimate.x.insert(estimate.x.end(), value, value + block.geometry().ambient);
    for (int i = 0; i < block.geometry().tangent; ++i) rows.push_back(block.tangent_offset + i);
  }
  estimate.p = state.covariance().Dense()(rows, rows);
  return estimate;
}

void ExpectNear(const Estimate& found, const Estimate& expected, double tolerance, std::size_t k) {
  ASSERT_EQ(found.x.size(), expected.x.size()) << k;
  for (std::size_t i = 0; i < found.x.size(); ++i) {
    EXPECT_NEAR(found.x[i], expected.x[i], tolerance) << k << ' ' << i;
  }
  ASSERT_EQ(found.p.rows(), expected.p.rows()) << k;
  EXPECT_LT((found.p - expected.p).cwiseAbs().maxCoeff(), tolerance) << k;
}

std::vector<Estimate> SmoothOver(Estimator& estimator, const std::vector<Frame>& frames) {
  for (const Frame& frame : frames) estimator.Process(frame);
  std::vector<Estimate> result;
  estimator.Smooth([&](std::size_t k, const State& state, const UpdateReport& report) {
    EXPECT_EQ(k, result.size());
    EXPECT_EQ(report.measurements().size(), frames[k].measurements.size());
    result.push_back(EstimateOf(state));
  });
  return result;
}

// ---- linear -------------------------------------------------------------------------------------

/// Returns the problem of a point with process noise of rank 1. One sensor measures the position of
/// the point, and another sensor measures the velocity.
Problem LinearSystem() {
  Problem problem = testing::LinearSystem();
  AddSensor(problem, "rate", testing::LinearSensor(1.5, 0.8), {"p.v"});
  return problem;
}

/// Returns 20 frames per second. In some frames, one sensor or both have no measurement.
std::vector<Frame> LinearFrames(int count) {
  std::vector<Frame> frames;
  for (int k = 0; k < count; ++k) {
    const double t_s = 0.05 * k;
    std::vector<std::pair<int, double>> values;
    if (k % 4 != 3) values.emplace_back(0, 2.0 * std::cos(t_s) + 0.3 * std::sin(37.0 * k));
    if (k % 3 != 1) values.emplace_back(1, -1.5 * std::sin(t_s) + 0.8 * std::sin(23.0 * k));
    frames.push_back(FrameAt(t_s, values));
  }
  return frames;
}

constexpr const char* kThreeFrames = "lag_s: 0.1\n";

TEST(FixedLag, OverAllFramesIsTheBatchOfTheDataSoFar) {
  const auto lag = MakeFixedLag(LinearSystem(), "lag_s: 1e12\n");
  const auto batch = MakeBatch(LinearSystem(), "mode: filtering\n");
  EXPECT_FALSE(lag->offline());
  const std::vector<Frame> frames = LinearFrames(40);
  for (std::size_t k = 0; k < frames.size(); ++k) {
    EXPECT_EQ(lag->Process(frames[k]).measurements().size(), frames[k].measurements.size());
    batch->Process(frames[k]);
    ExpectNear(EstimateOf(lag->state()), EstimateOf(batch->state()), 1e-9, k);
    EXPECT_EQ(lag->timestamp(), frames[k].timestamp);
  }
  EXPECT_FALSE(lag->failed());
}

/// Expects the newest estimates of a three-frame window to equal those of the Kalman filter.
void ExpectTheKalmanFilter(const Problem& problem, const std::vector<Frame>& frames,
                           const std::string& options = kThreeFrames) {
  const auto lag = MakeFixedLag(problem, options);
  Ekf ekf(problem, {}, testing::StreamsOf(problem));
  for (std::size_t k = 0; k < frames.size(); ++k) {
    lag->Process(frames[k]);
    ekf.Process(frames[k]);
    ExpectNear(EstimateOf(lag->state()), EstimateOf(ekf.state()), 1e-9, k);
  }
  EXPECT_FALSE(lag->failed());
}

TEST(FixedLag, OfALinearProblemIsTheKalmanFilterWhateverTheWindow) {
  const std::vector<Frame> frames = LinearFrames(60);
  ExpectTheKalmanFilter(LinearSystem(), frames);
  ExpectTheKalmanFilter(LinearSystem(), frames,
                        "lag_s: 0.04\n");  // the window is shorter than the time between two frames
  ExpectTheKalmanFilter(LinearSystem(), frames, "lag_s: 0.7\n");
  std::vector<Frame> gap = LinearFrames(10);  // the whole window leaves at once
  gap.push_back(FrameAt(4.0, {{0, 1.2}}));
  gap.push_back(FrameAt(4.05, {{1, 0.3}}));
  ExpectTheKalmanFilter(LinearSystem(), gap);
}

// The estimate of frame k uses two later frames. The batch of the first k + 3 frames uses the same
// data.
TEST(FixedLag, OfTheOldestFrameIsTheBatchWithAsManyLaterOnes) {
  const std::vector<Frame> frames = LinearFrames(30);
  const auto lag = MakeFixedLag(LinearSystem(), std::string(kThreeFrames) + "output: lagged\n");
  EXPECT_TRUE(lag->offline());
  const std::vector<Estimate> found = SmoothOver(*lag, frames);
  ASSERT_EQ(found.size(), frames.size());
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const std::size_t end = std::min(k + 3, frames.size());
    const std::vector<Frame> known(frames.begin(),
                                   frames.begin() + static_cast<std::ptrdiff_t>(end));
    const std::vector<Estimate> batch = SmoothOver(*MakeBatch(LinearSystem()), known);
    ExpectNear(found[k], batch[k], 1e-9, k);
  }
}

// P_0 is zero for the velocity, and Q is zero. The exactly known velocity therefore stays exactly
// known.
TEST(FixedLag, WhatIsKnownStays) {
  Problem problem = LinearSystem();
  problem.priors[1].covariance.setZero();
  problem.motions[0].model = MakeMotion(ConstantVelocity<1, false>(0.0), "still");
  const auto lag = MakeFixedLag(problem, kThreeFrames);
  for (const Frame& frame : LinearFrames(40)) lag->Process(frame);
  EXPECT_DOUBLE_EQ(testing::ValueOf(lag->state(), "p.v"), -0.5);
  EXPECT_DOUBLE_EQ(testing::CovarianceOf(lag->state(), "p.v", "p.v"), 0.0);
  ExpectTheKalmanFilter(problem, LinearFrames(40));
}

// The first frames contain no measurement of p.x. A later frame initialises p.x.
TEST(FixedLag, ABlockMayStartFromAMeasurement) {
  Problem problem = LinearSystem();
  problem.priors[0].sensor = "z";
  std::vector<Frame> frames = LinearFrames(30);
  for (std::size_t k = 0; k < 4; ++k)
    std::erase_if(frames[k].measurements, [](const Measurement& m) { return m.stream == 0; });
  const BlockId x = problem.layout.Find("p.x");
  const auto lag = MakeFixedLag(problem, kThreeFrames);
  const auto late = MakeFixedLag(problem, std::string(kThreeFrames) + "output: lagged\n");
  Ekf ekf(problem, {}, testing::StreamsOf(problem));
  for (std::size_t k = 0; k < frames.size(); ++k) {
    lag->Process(frames[k]);
    late->Process(frames[k]);
    ekf.Process(frames[k]);
    ASSERT_EQ(lag->state().layout()[x].present, k >= 4) << k;
    ExpectNear(EstimateOf(lag->state()), EstimateOf(ekf.state()), 1e-9, k);
  }
  late->Smooth([&](std::size_t k, const State& state, const UpdateReport&) {
    EXPECT_EQ(state.layout()[x].present, k >= 4) << k;
    if (k + 1 == frames.size()) ExpectNear(EstimateOf(state), EstimateOf(ekf.state()), 1e-9, k);
  });
}

// ---- nonlinear ----------------------------------------------------------------------------------

/// Returns frames of a target at the depth 0.3 + 0.1 sin(2.5 t) m. Most frames contain the
/// disparity of the target (BF = 26 px m), and all frames contain 1 / scale.
std::vector<Frame> DepthFrames(int count) {
  std::vector<Frame> frames;
  for (int k = 0; k < count; ++k) {
    const double t_s = 0.033 * k, depth = 0.3 + 0.1 * std::sin(2.5 * t_s);
    Frame frame = FrameAt(t_s, {{1, depth / 0.3 + 0.006 * std::sin(37.0 * k)}});
    if (k % 7 < 4) {
      const double far_off = k % 10 == 6 ? 8.0 : 0.0;
      frame.measurements.push_back(
          {frame.timestamp, 0, -1, {26.0 / depth + std::cos(23.0 * k) + far_off}, {}});
    }
    frames.push_back(frame);
  }
  return frames;
}

/// Expects that the smoother equals the batch of all data. The whole window leaves at once, before
/// a frame without information. The window was therefore linearised at the optimum.
void ExpectLeavingChangesNothing(const Problem& problem, std::vector<Frame> frames) {
  const double lag_s = Seconds(frames.back().timestamp - frames.front().timestamp);
  frames.push_back({frames.back().timestamp + TimestampFromSeconds(lag_s + 0.1), {}});
  const auto lag = MakeFixedLag(problem, "lag_s: " + std::to_string(lag_s + 0.01) + "\n");
  const auto batch = MakeBatch(problem, "mode: filtering\n");
  for (const Frame& frame : frames) {
    lag->Process(frame);
    batch->Process(frame);
    ASSERT_FALSE(lag->failed());
  }
  ExpectNear(EstimateOf(lag->state()), EstimateOf(batch->state()), 1e-8, frames.size());
}

TEST(FixedLag, FramesThatLeaveTakeNothingWithThem) {
  Problem problem = testing::DepthFilter();  // R of this problem depends on the state
  ExpectLeavingChangesNothing(problem, DepthFrames(30));
  for (SensorBinding& sensor : problem.sensors) sensor.loss = {LossKind::kHuber, 1.0};
  ExpectLeavingChangesNothing(problem, DepthFrames(30));
  for (SensorBinding& sensor : problem.sensors) sensor.loss = {LossKind::kCauchy, 2.0};
  ExpectLeavingChangesNothing(problem, DepthFrames(30));
}

template <class G>
Problem OnManifold(const Geometry& geometry) {
  Problem problem;
  const SharedMotion model = MakeMotion(testing::ManifoldWalk<G, 0.1>(), "wander");
  const BlockId id = problem.layout.Declare("p.x", "p", model->blocks()[0]);
  problem.motions.push_back({"p", model, {id}});
  const int t = geometry.tangent;
  const std::vector<double> mean = geometry.Identity();
  problem.priors.push_back({id, mean, 0.25 * Eigen::MatrixXd::Identity(t, t), ""});
  AddSensor(problem, "z", MakeSensor(testing::ManifoldSensor<G, 0.4>(), "direct"), {"p.x"});
  return problem;
}

/// Returns frames with measurements that are far from the mean and from each other.
std::vector<Frame> FramesOnManifold(const Geometry& geometry, int count) {
  std::vector<Frame> frames;
  const std::vector<double> mean = geometry.Identity();
  for (int k = 0; k < count; ++k) {
    const double d[3] = {0.9 + 0.4 * std::sin(2.0 * k), -0.5 * std::cos(3.0 * k), 0.3};
    Measurement m{TimestampFromSeconds(0.1 * k), 0, -1, mean, {}};
    geometry.Plus(mean.data(), d, m.values.data());
    frames.push_back({m.timestamp, {m}});
  }
  return frames;
}

/// Expects that the estimate stays within `tolerance` sigmas of that of the batch if frames leave
/// the window one by one.
template <class G>
void ExpectNearTheBatch(const Geometry& geometry, double tolerance) {
  const Problem problem = OnManifold<G>(geometry);
  ExpectLeavingChangesNothing(problem, FramesOnManifold(geometry, 4));
  const auto lag = MakeFixedLag(problem, "lag_s: 0.3\n");
  const auto batch = MakeBatch(problem, "mode: filtering\n");
  double worst = 0.0;
  for (const Frame& frame : FramesOnManifold(geometry, 20)) {
    lag->Process(frame);
    batch->Process(frame);
    ASSERT_FALSE(lag->failed());
    EXPECT_NEAR(DistanceFrom(geometry, lag->state().values().data()), 0.0, 1e-12);
    double d[3];
    geometry.Minus(lag->state().values().data(), batch->state().values().data(), d);
    for (int i = 0; i < geometry.tangent; ++i) {
      worst = std::max(worst, std::abs(d[i]) / std::sqrt(batch->state().covariance().Variance(i)));
    }
  }
  EXPECT_LT(worst, tolerance);
}

TEST(FixedLag, IsNearTheBatchOnManifolds) {
  ExpectNearTheBatch<UnitQuaternion>(Geometry::UnitQuaternion(), 0.05);
  ExpectNearTheBatch<UnitVector>(Geometry::UnitVector(), 0.05);
  ExpectNearTheBatch<Angle>(Geometry::Angle(), 1e-9);
}

// ---- runs ---------------------------------------------------------------------------------------

/// Runs example 08 with the given estimators and settings.
RunResult RunDepth(const std::string& estimators,
                   const std::vector<std::pair<std::string, std::string>>& settings = {}) {
  Config config =
      Config::FromFile(ALIDADE_SOURCE_DIR "/examples/08_depth_all_estimators/config.yaml");
  config.Set("estimators", estimators, "--set");
  for (const auto& [key, value] : settings) config.Set(key, value, "--set");
  Experiment experiment = BuildExperiment(config, Shipped());
  return Run(experiment, {});
}

/// Returns the mean of a metric over all runs, in the order of the estimators.
std::vector<double> Means(const std::vector<RunResult>& runs, const std::string& metric) {
  std::vector<double> means;
  for (const RunResult& run : runs) {
    means.resize(run.estimators.size());
    for (std::size_t i = 0; i < means.size(); ++i) {
      means[i] += run.estimators[i].metrics.at(metric) / static_cast<double>(runs.size());
    }
  }
  return means;
}

// The process noise has rank 1, and the size of the template is known exactly.
TEST(FixedLag, LiesBetweenTheFilterAndTheBatchAndIsHonest) {
  std::vector<RunResult> runs;
  for (int seed = 1001; seed <= 1012; ++seed) {
    runs.push_back(RunDepth(
        "{ekf: {type: ekf}, newest: {type: fixed_lag, lag_s: 0.5}, "
        "delayed: {type: fixed_lag, lag_s: 0.5, output: lagged}, batch: {type: ceres_batch}}",
        {{"source.seed", std::to_string(seed)},
         {"state.template.initial.inverse_distance", "{mean: 3.3333333333333335, sigma: 0}"},
         {"state.target.initial.depth", "{mean: 0.35, sigma: 0.1}"},
         {"state.target.initial.depth_rate", "{mean: 0, sigma: 0.5}"}}));
    ASSERT_EQ(runs.back().status, RunStatus::kOk) << runs.back().reason;
    ASSERT_EQ(runs.back().estimators.size(), 4u);
  }
  // Measured RMSE of the four estimators: depth 1.7251, 1.7134, 0.8691, 0.8692 mm; rate 38.5, 38.2,
  // 11.67, 11.68 mm/s.
  for (const char* block : {"target.depth", "target.depth_rate"}) {
    const std::vector<double> rmse = Means(runs, std::string("rmse:") + block);
    EXPECT_LT(rmse[1], rmse[0]) << block;
    EXPECT_GT(rmse[1], rmse[3]) << block;
    EXPECT_NEAR(rmse[2] / rmse[3], 1.0, 0.01) << block;
  }
  // The target swings less than the process noise allows. NEES is therefore below 1: 0.727 for the
  // filter and the window, and 0.530 for the two smoothers.
  const std::vector<double> nees = Means(runs, "nees.mean:target");
  EXPECT_NEAR(nees[1], nees[0], 0.02);
  EXPECT_NEAR(nees[2], nees[3], 0.02);
  for (const double share : Means(runs, "nees.within95:target")) EXPECT_GT(share, 0.97);
}

// The smoother has no gate, but its stereo sensor rejects distances below 0.3 m. Half of the
// measurements have such distances.
TEST(FixedLag, LendsWhatItAccepted) {
  const RunResult run = RunDepth(
      "{one: {type: fixed_lag, lag_s: 0.3, overrides: {sensors: {stereo: {min_range_m: 0.3}}}}, "
      "two: {type: ekf, use: {accepted_by: one}}, all: {type: ekf}}",
      {{"source.min_range_m", "0"}});
  ASSERT_EQ(run.status, RunStatus::kOk) << run.reason;
  std::vector<std::int64_t> accepted;
  for (const auto& one : run.estimators) accepted.push_back(one.counts.at("accepted:stereo"));
  EXPECT_GT(accepted[0], 50);
  EXPECT_LT(accepted[0], 100);
  EXPECT_EQ(accepted[1], accepted[0]);
  EXPECT_EQ(accepted[2], 152);
  for (const auto& one : run.estimators) EXPECT_EQ(one.counts.at("accepted:scale"), 152);
}

TEST(FixedLag, IsRefusedWhatItCannotDo) {
  const auto expect_refused = [](const std::string& options, const std::string& key,
                                 const std::string& value, const std::string& what) {
    try {
      RunDepth("{one: {type: fixed_lag" + options + "}}", {{key, value}});
      ADD_FAILURE() << "accepted " << key << ": " << value;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ExitCode::kBadConfig);
      EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
    }
  };
  const std::string window = ", lag_s: 0.3";
  expect_refused(window, "sensors.scale.roles",
                 "{depth: target.depth, inverse_distance: {block: template.inverse_distance, mode: "
                 "known}}",
                 "sensors.scale.roles.inverse_distance.mode: "
                 "estimator type 'fixed_lag' does not support known roles");
  expect_refused(window, "state.template.consider", "[inverse_distance]",
                 "estimator type 'fixed_lag' does not support consider blocks");
  expect_refused(window, "estimators.one.gate", "0.99", "estimator type 'fixed_lag' has no gate");
  expect_refused("", "source.seed", "1", "lag_s");
  expect_refused(", lag_s: 0", "source.seed", "1", "lag_s");
  expect_refused(window, "estimators.one.output", "lag", "lagged");
}

TEST(FixedLag, ARefusedFrameIsTheLast) {
  const auto lag = MakeFixedLag(LinearSystem(), "lag_s: 1\noutput: lagged\nmax_dt_s: 0.001\n");
  lag->Process(FrameAt(0.0, {{0, 1.0}}));
  EXPECT_FALSE(lag->Process(FrameAt(1000.0, {{0, 1.0}})).events.empty());
  EXPECT_TRUE(lag->failed());
  EXPECT_TRUE(lag->Process(FrameAt(0.001, {{0, 1.0}})).events.empty());
  EXPECT_THROW(lag->Smooth([](std::size_t, const State&, const UpdateReport&) {}), Error);
}

}  // namespace
}  // namespace alidade
