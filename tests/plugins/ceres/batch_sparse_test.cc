// SPDX-License-Identifier: Apache-2.0
//
// Tests that the sparse solver of the batch has the same results as the dense solver.
#include <Eigen/Geometry>
#include <cmath>

#include "alidade/base/random.h"
#include "alidade/experiment/estimator_plugin.h"
#include "alidade/experiment/run.h"
#include "batch_landmarks_fixture.h"
#include "support/driven.h"
#include "support/manifold_models.h"

namespace alidade {
namespace {

using testing::Found;
using testing::FrameAt;
using testing::MakeBatch;
using testing::Shipped;

constexpr double kStates = 1e-8;       // tolerance, in sigma
constexpr double kCovariances = 1e-6;  // tolerance, in sigma_i sigma_j

double CostOf(const Found& found) {
  const std::string& text = found.events.back().text;
  return std::stod(text.substr(text.find("cost ") + 5));
}

/// Returns the difference x (-) y of two states.
Eigen::VectorXd Apart(const State& x, const State& y) {
  Eigen::VectorXd d = Eigen::VectorXd::Zero(y.covariance().size());
  for (std::size_t i = 0; i < y.layout().blocks().size(); ++i) {
    const Block& block = y.layout().blocks()[i];
    if (!block.present || !block.has_covariance()) continue;
    const auto id = static_cast<BlockId>(i);
    block.geometry().Minus(x.value(id), y.value(id), d.data() + block.tangent_offset);
  }
  return d;
}

void ExpectSame(const Found& found, const Found& expected, double states = kStates,
                double covariances = kCovariances) {
  ASSERT_FALSE(found.failed) << found.events.back().text;
  ASSERT_FALSE(expected.failed) << expected.events.back().text;
  EXPECT_NE(found.events.back().text.find("sparse"), std::string::npos);
  EXPECT_EQ(expected.events.back().text.find("sparse"), std::string::npos);
  EXPECT_NEAR(CostOf(found), CostOf(expected),
              2e-8 * (1.0 + CostOf(expected)));  // the cost is printed with nine digits
  ASSERT_EQ(found.states.size(), expected.states.size());
  double worst_x = 0.0, worst_p = 0.0;
  for (std::size_t k = 0; k < found.states.size(); ++k) {
    const Eigen::VectorXd d = Apart(found.states[k], expected.states[k]);
    const Eigen::MatrixXd p = expected.states[k].covariance().Dense();
    const Eigen::MatrixXd e = found.states[k].covariance().Dense() - p;
    for (Eigen::Index i = 0; i < d.size(); ++i) {
      // The sigma of an exact value is only a rounding error.
      const double sigma = std::max(std::sqrt(p(i, i)), 1e-5);
      worst_x = std::max(worst_x, std::abs(d[i]) / sigma);
      for (Eigen::Index j = 0; j < d.size(); ++j) {
        worst_p =
            std::max(worst_p, std::abs(e(i, j)) / (sigma * std::max(std::sqrt(p(j, j)), 1e-5)));
      }
    }
  }
  EXPECT_LT(worst_x, states);
  EXPECT_LT(worst_p, covariances);
  ASSERT_EQ(found.map.size(), expected.map.size());
  double worst_y = 0.0, worst_c = 0.0;
  for (std::size_t i = 0; i < found.map.size(); ++i) {
    const LandmarkEstimate &a = found.map[i], &b = expected.map[i];
    EXPECT_EQ(a.id, b.id);
    if (!b.position.allFinite()) continue;
    const Eigen::LLT<Eigen::Matrix3d> llt(b.covariance);
    worst_y = std::max(worst_y, llt.matrixL().solve(a.position - b.position).norm());
    const Eigen::Matrix3d e = a.covariance - b.covariance;
    worst_c = std::max(worst_c, llt.solve(e).norm());
    if (!std::isnan(b.sigma)) worst_c = std::max(worst_c, std::abs(a.sigma / b.sigma - 1.0));
  }
  // The tolerance is larger for landmarks: the dense solver stops moving them once rounding hides
  // the decrease of the cost.
  EXPECT_LT(worst_y, 10.0 * states);
  EXPECT_LT(worst_c, covariances);
}

/// Returns the problem with a loss that has no effect. With a loss the dense solver continues below
/// the tolerances of Ceres.
Problem WithLoss(Problem problem) {
  for (SensorBinding& sensor : problem.sensors) {
    if (sensor.loss.kind == LossKind::kNone) sensor.loss = {LossKind::kHuber, 1e9};
  }
  return problem;
}

void ExpectBothSolve(const Problem& problem, const std::vector<Frame>& frames,
                     const std::string& options = "", double states = kStates,
                     double covariances = kCovariances) {
  ExpectSame(testing::Solve(problem, frames, "solver: sparse\n" + options),
             testing::Solve(WithLoss(problem), frames, "solver: dense\n" + options), states,
             covariances);
}

std::vector<Frame> Wobble(int count) {
  std::vector<Frame> frames;
  for (int k = 0; k < count; ++k) {
    const double t_s = 0.05 * k, z = 2.0 * std::cos(t_s) + 0.3 * std::sin(37.0 * k);
    frames.push_back(k % 4 == 3 ? FrameAt(t_s, {}) : FrameAt(t_s, {{0, z}}));
  }
  return frames;
}

void SetPrior(Problem& problem, std::size_t prior, double sigma) {
  problem.priors[prior].covariance.setConstant(sigma * sigma);
}

/// Results of the sparse and the dense batch of a config.
struct Both {
  Found sparse, dense;
};
Both SolveBoth(Config config, std::size_t most_frames) {
  std::vector<std::string> plain;
  for (const auto& [name, sensor] : config.root().Find("sensors")->Entries()) {
    if (!sensor.Find("loss")) plain.push_back(name);
  }
  for (const std::string& name : plain) {
    config.Set("sensors." + name + ".loss", "{huber: 1e9}", "--set");
  }
  config.Set("estimators",
             "{ekf: {type: ekf}, sparse: {type: ceres_batch, solver: sparse}, "
             "dense: {type: ceres_batch, solver: dense}}",
             "--set");
  Experiment experiment = BuildExperiment(config, Shipped());
  std::vector<Frame> frames;
  for (SourceFrame frame; frames.size() < most_frames && experiment.source->Next(frame);) {
    frames.push_back(frame);
  }
  return {testing::Solve(*experiment.estimators[1].estimator, frames),
          testing::Solve(*experiment.estimators[2].estimator, frames)};
}
Config Example(const std::string& name) {
  return Config::FromFile(ALIDADE_SOURCE_DIR "/examples/" + name + "/config.yaml");
}

// The noise has rank 1 (of 2) or rank 0. The prior is uncertain, partly exact, or entirely exact.
TEST(SparseBatch, NoiseAndPriorMayHaveAnyRank) {
  for (const double acceleration : {0.7, 0.0}) {
    for (const double sigma_x : {2.0, 0.0}) {
      for (const double sigma_v : {3.0, 0.0}) {
        SCOPED_TRACE(::testing::Message() << acceleration << ' ' << sigma_x << ' ' << sigma_v);
        Problem problem = testing::MovingPoint(acceleration);
        testing::AddSensor(problem, "z", testing::LinearSensor(2.0, 0.3), {"p.x"});
        SetPrior(problem, 0, sigma_x);
        SetPrior(problem, 1, sigma_v);
        ExpectBothSolve(problem, Wobble(60));
      }
    }
  }
}

// The variance of the first velocity is 1e10 times smaller than that of its prior. The batch must
// not compute this variance as a difference of two numbers of the size of the prior.
TEST(SparseBatch, AVagueStartCostsNoDigits) {
  Problem problem = testing::LinearSystem();
  for (std::size_t i = 0; i < problem.priors.size(); ++i) SetPrior(problem, i, 1e4);
  ExpectBothSolve(problem, Wobble(60));
}

TEST(SparseBatch, WhereAllIsKnownNothingIsSolved) {
  Problem problem;
  testing::AddMotion(problem, "p", testing::ConstantMotion(1), {{"x", 2.0, 0.0}});
  testing::AddSensor(problem, "z", testing::LinearSensor(2.0, 0.3), {"p.x"});
  problem = testing::WithStatus(problem, "p.x", BlockStatus::kConstant);
  const Found found = testing::Solve(problem, Wobble(5), "solver: sparse\n");
  ASSERT_FALSE(found.failed);
  EXPECT_EQ(testing::ValueOf(found.states.back(), "p.x"), 2.0);
}

// The noise is held over frames without a measurement. The sparse system therefore has no variables
// of its own for these frames.
TEST(SparseBatch, FramesBetweenMeasurementsHaveTheirCovariance) {
  Problem problem = testing::HeldPoint(0.7);
  testing::AddSensor(problem, "z", testing::LinearSensor(2.0, 0.3), {"p.x"});
  std::vector<Frame> frames = Wobble(50);
  for (std::size_t k = 0; k < frames.size(); ++k) {
    if (k % 5 != 2) frames[k].measurements.clear();
  }
  ExpectBothSolve(problem, frames);
  ExpectBothSolve(problem, frames, "max_dt_s: 0.02\n");
}

TEST(SparseBatch, SolvesOnManifolds) {
  const Problem problem = testing::WalkingOrientation();
  std::vector<Frame> frames;
  for (int k = 0; k < 80; ++k) {
    Frame frame = FrameAt(0.05 * k, {});
    const double a = 0.05 * std::sin(0.3 * k), b = 0.002 * k;
    frame.measurements.push_back({frame.timestamp,
                                  0,
                                  -1,
                                  {std::cos(a) * std::cos(b), std::sin(a) * std::cos(b),
                                   std::sin(b) * std::cos(a), std::sin(a) * std::sin(b)},
                                  {}});
    frames.push_back(frame);
  }
  ExpectBothSolve(problem, frames);
}

TEST(SparseBatch, SolvesTheExamplesWithoutAMap) {
  for (const char* name : {"05_depth_principled", "08_depth_all_estimators", "21_poses",
                           "22_range_bearing", "23_satellites", "33_formula_models"}) {
    SCOPED_TRACE(name);
    const Both both = SolveBoth(Example(name), 40);
    ExpectSame(both.sparse, both.dense);
  }
}

/// Problem and data of a body with an inertial unit at 100 Hz and a position sensor at 2 Hz. The
/// noise of the position sensor is 0.1 m. The model generates the trajectory from the readings of
/// the unit, which have biases and noise.
struct InertialRun {
  Problem problem;
  std::vector<Frame> frames;
  Eigen::Vector3d position = Eigen::Vector3d::Zero(), bias{0.1, -0.05, 0.08};

  explicit InertialRun(int count) {
    const SharedMotion model = MakeMotion(testing::Inertial(), "inertial");
    MotionBinding binding{"b", model, {}, {"readings"}};
    const double sigmas[] = {0.1, 0.1, 0.02, 0.1, 0.01};
    for (std::size_t i = 0; i < 5; ++i) {
      binding.blocks.push_back(
          problem.layout.Declare("b." + model->blocks()[i].name, "b", model->blocks()[i]));
      Prior prior;
      prior.block = binding.blocks.back();
      prior.mean.assign(static_cast<std::size_t>(model->blocks()[i].geometry.ambient), 0.0);
      if (i == 2) prior.mean[0] = 1.0;
      prior.covariance = sigmas[i] * sigmas[i] * Eigen::Matrix3d::Identity();
      problem.priors.push_back(prior);
    }
    problem.motions.push_back(binding);
    testing::AddSensor(problem, "fix", MakeSensor(testing::Position3(), "position"),
                       {"b.position"});
    Random random(9);
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
    Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
    for (int k = 0; k < count; ++k) {
      const double t_s = 0.01 * k;
      Frame frame = FrameAt(t_s, {});
      if (k % 50 == 0) {
        const auto n = [&] { return 0.1 * random.Normal(); };
        frame.measurements.push_back({frame.timestamp,
                                      0,
                                      -1,
                                      {position.x() + n(), position.y() + n(), position.z() + n()},
                                      {}});
      }
      const Eigen::Vector3d force =
                                q.conjugate() * Eigen::Vector3d(std::cos(t_s), std::sin(t_s), 9.81),
                            rate(0.3 * std::sin(0.7 * t_s), 0.2 * std::cos(t_s), 0.3);
      std::vector<double> readings(6);
      for (std::size_t i = 0; i < 3; ++i) {
        const auto e = static_cast<Eigen::Index>(i);
        readings[i] = force[e] + bias[e] + 0.2 * random.Normal();
        readings[3 + i] = rate[e] + 0.02 * random.Normal();
      }
      frame.measurements.push_back({frame.timestamp, 1, -1, readings, {}});
      position += 0.01 * velocity;
      velocity += 0.01 * Eigen::Vector3d(std::cos(t_s), std::sin(t_s), 0.0);
      const Eigen::Vector3d turn = 0.01 * rate;
      q = q * Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
      frames.push_back(std::move(frame));
    }
  }
  Found Solve(const std::string& options) const {
    const Config config = Config::FromText("type: ceres_batch\n" + options, "batch.yaml");
    const auto batch = CreateEstimator(Shipped(), "ceres_batch", config.root())(
        WithLoss(problem), {{"fix", 3}, {"readings", 6}});
    return testing::Solve(*batch, frames);
  }
};

// The dense solver can solve 0.8 s of data, but not 60 s of data, which have 72 015 inputs.
TEST(SparseBatch, SolvesInertialReadings) {
  const InertialRun little(80);
  ExpectSame(little.Solve("solver: sparse\n"), little.Solve("solver: dense\n"));
  const InertialRun minute(6000);
  const Found found = minute.Solve("solver: sparse\n");
  ASSERT_FALSE(found.failed) << found.events.back().text;
  RecordProperty("solution", found.events.back().text);
  const State& last = found.states.back();
  const auto expect = [&](const char* name, const Eigen::Vector3d& truth) {
    const Block& block = last.layout()[last.layout().Find(name)];
    const double* const x = last.values().data() + block.value_offset;
    for (int i = 0; i < 3; ++i) {
      const double sigma = std::sqrt(last.covariance().Variance(block.tangent_offset + i));
      EXPECT_LT(std::abs(x[i] - truth[i]), 4.0 * sigma) << name << i;
      EXPECT_LT(sigma, 0.15) << name << i;
    }
  };
  expect("b.position", minute.position);
  expect("b.force_bias", minute.bias);
}

// The position has seven digits before the point. Rounding alone then causes steps of 1e-6 sigma.
TEST(SparseBatch, ConvergesFarFromTheOrigin) {
  Config config = Example("21_poses");
  config.Set("state.body.initial.position.mean", "[5e5, 5e6, 0]", "--set");
  config.Set("sensors.mocap.sigma_position_m", "0.01", "--set");
  config.Set("estimators",
             "{sparse: {type: ceres_batch, solver: sparse}, "
             "dense: {type: ceres_batch, solver: dense}, "
             "filtering: {type: ceres_batch, mode: filtering, solver: sparse}, "
             "incremental: {type: ceres_batch, mode: incremental, relinearise_above: 1e-9}}",
             "--set");
  Experiment experiment = BuildExperiment(config, Shipped());
  const auto& estimators = experiment.estimators;
  std::vector<Frame> frames;
  for (SourceFrame frame; frames.size() < 60 && experiment.source->Next(frame);) {
    frames.push_back(frame);
  }
  const Found sparse = testing::Solve(*estimators[0].estimator, frames);
  ExpectSame(sparse, testing::Solve(*estimators[1].estimator, frames), 1e-6, 1e-6);
  for (const Frame& frame : frames) {
    for (std::size_t i = 2; i < 4; ++i) {
      const UpdateReport& report = estimators[i].estimator->Process(frame);
      EXPECT_EQ(std::ranges::count(report.events, EventKind::kSolvedAsAWhole, &Event::kind), 0);
      ASSERT_FALSE(estimators[i].estimator->failed());
    }
  }
  // At the last frame, smoothing and filtering use the same data.
  const State& last = sparse.states.back();
  for (std::size_t i = 2; i < 4; ++i) {
    const Eigen::VectorXd d = Apart(estimators[i].estimator->state(), last);
    for (int e = 0; e < d.size(); ++e) {
      EXPECT_LT(std::abs(d[e]), 1e-6 * std::sqrt(last.covariance().Variance(e))) << e;
    }
  }
}

TEST(SparseBatch, SolvesWithLandmarks) {
  const testing::MapProblem map(12, 15);
  ExpectBothSolve(map.Filter(), map.frames);
  map.ExpectSolved(testing::Solve(map.Filter(), map.frames, "solver: sparse\n"));
}

TEST(SparseBatch, SolvesTheSlamExamples) {
  for (const char* representation : {"inverse_depth", "anchored"}) {
    SCOPED_TRACE(representation);
    Config config = Example("10_slam_scene");
    config.Set("landmarks.representation", representation, "--set");
    const Both both = SolveBoth(config, 40);
    ExpectSame(both.sparse, both.dense);
  }
}

// The vehicle is driven by odometry. There are fewer landmarks than frames.
TEST(SparseBatch, SolvesADriveWithControlInputs) {
  const Both both = SolveBoth(Example("15_slam_representations"), 60);
  ExpectSame(both.sparse, both.dense);
}

// A stereo measurement has four numbers, while a point has three.
TEST(SparseBatch, SolvesWithStereoPairs) {
  const Both both = SolveBoth(
      Config::FromFile(ALIDADE_SOURCE_DIR "/examples/26_slam_three_sensors/stereo.yaml"), 30);
  ExpectSame(both.sparse, both.dense);
}

// With a few frames the prior dominates the depths. A Gauss-Newton step is then more than twice too
// long, and the next step goes back by nearly the same length. Extrapolation from the last few
// steps makes the solver converge.
TEST(SparseBatch, ConvergesWhereStepsGoTooFar) {
  Config config = Example("16_slam_room");
  config.Set("source.seed", "1001", "--set");
  config.Set("estimators", "{batch: {type: ceres_batch, solver: sparse}}", "--set");
  Experiment experiment = BuildExperiment(config, Shipped());
  Estimator& batch = *experiment.estimators[0].estimator;
  SourceFrame frame;
  for (int k = 0; k < 5 && experiment.source->Next(frame); ++k) batch.Process(frame);
  std::string solution;
  batch.Smooth([&](std::size_t, const State&, const UpdateReport& report) {
    for (const Event& event : report.events) solution = event.text;
  });
  EXPECT_FALSE(batch.failed()) << solution;
  const std::size_t at = solution.find(", ");
  ASSERT_NE(at, std::string::npos);
  EXPECT_LT(std::stoi(solution.substr(at + 2)), 60) << solution;
}

// At the initial estimate an observation is not defined. The dense solver cannot start there; the
// sparse solver can.
TEST(SparseBatch, StartsWhereAnObservationIsNotDefined) {
  Config config = Example("15_slam_representations");
  config.Set("estimators", "{batch: {type: ceres_batch, solver: sparse}}", "--set");
  Experiment experiment = BuildExperiment(config, Shipped());
  Estimator& batch = *experiment.estimators[0].estimator;
  SourceFrame frame;
  for (int k = 0; k < 140 && experiment.source->Next(frame); ++k) batch.Process(frame);
  int used = 0, undefined = 0;
  batch.Smooth([&](std::size_t, const State&, const UpdateReport& report) {
    for (const MeasurementReport& one : report.measurements()) {
      if (one.outcome != Outcome::kAccepted) continue;
      ++used;
      undefined += one.h.empty() ? 1 : 0;
    }
  });
  EXPECT_FALSE(batch.failed());
  EXPECT_GT(used, 1000);
  EXPECT_EQ(undefined, 0);
}

// The filtering mode solves at every frame, with the data so far.
TEST(SparseBatch, SolvesForTheDataSoFar) {
  const testing::MapProblem map(8, 10);
  const Problem problem = map.Filter();
  const auto sparse = MakeBatch(problem, "mode: filtering\nsolver: sparse\n"),
             dense = MakeBatch(WithLoss(problem), "mode: filtering\nsolver: dense\n");
  for (const Frame& frame : map.frames) {
    sparse->Process(frame);
    dense->Process(frame);
    ASSERT_FALSE(sparse->failed());
    const Eigen::MatrixXd p = dense->state().covariance().Dense();
    const Eigen::VectorXd d = Apart(sparse->state(), dense->state());
    EXPECT_LE(d.norm(), kStates * std::sqrt(p.trace()));
    EXPECT_LE((sparse->state().covariance().Dense() - p).norm(), kCovariances * p.norm());
    EXPECT_EQ(sparse->landmarks().size(), dense->landmarks().size());
  }
}

// A twentieth of the measurements are outliers.
TEST(SparseBatch, RobustLossesHaveTheSameOptimum) {
  for (const RobustLoss loss : {RobustLoss{LossKind::kHuber, 1.345}, {LossKind::kCauchy, 2.4}}) {
    SCOPED_TRACE(ToString(loss.kind));
    Problem problem = testing::MovingPoint(0.7);
    testing::AddSensor(problem, "z", testing::LinearSensor(2.0, 0.3), {"p.x"});
    problem.sensors[0].loss = loss;
    std::vector<Frame> frames = Wobble(80);
    for (std::size_t k = 0; k < frames.size(); ++k) {
      if (k % 20 == 4) frames[k].measurements[0].values[0] += 5.0;
    }
    ExpectBothSolve(problem, frames);
    testing::MapProblem map(12, 15, 20);
    map.loss = loss;
    ExpectBothSolve(map.Filter(), map.frames);
  }
}

// Consecutive states agree with the motion model: x' = x + v dt + a dt^2 / 2, v' = v + a dt for
// some a.
TEST(SparseBatch, TheMotionHoldsToRounding) {
  Problem problem = testing::HeldPoint(0.7);
  testing::AddSensor(problem, "z", testing::LinearSensor(2.0, 0.3), {"p.x"});
  const Found found = testing::Solve(problem, Wobble(300), "solver: sparse\n");
  ASSERT_EQ(found.states.size(), 300u);
  for (std::size_t k = 1; k < found.states.size(); ++k) {
    const std::vector<double>&a = found.states[k - 1].values(), &b = found.states[k].values();
    const double dt = 0.05, acceleration = (b[1] - a[1]) / dt;
    EXPECT_NEAR(b[0], a[0] + dt * a[1] + 0.5 * dt * dt * acceleration, 1e-12) << k;
  }
}

// 5002 inputs exceed the limit of a dense system, so the sparse solver is used. The last estimate
// equals that of a Kalman filter.
TEST(SparseBatch, IsTakenWhereThereAreManyInputs) {
  const Problem problem = testing::LinearSystem();
  const std::vector<Frame> frames = Wobble(5001);
  const Found found = testing::Solve(problem, frames);
  ASSERT_FALSE(found.failed);
  EXPECT_NE(found.events.back().text.find("converged; sparse"), std::string::npos);
  Ekf ekf(problem, {.gate = 1.0}, testing::StreamsOf(problem));
  for (const Frame& frame : frames) ekf.Process(frame);
  for (const char* block : {"p.x", "p.v"}) {
    EXPECT_NEAR(testing::ValueOf(found.states.back(), block), testing::ValueOf(ekf.state(), block),
                1e-9);
    EXPECT_NEAR(testing::CovarianceOf(found.states.back(), block, block),
                testing::CovarianceOf(ekf.state(), block, block), 1e-9);
  }
  EXPECT_EQ(testing::Solve(problem, Wobble(20)).events.back().text.find("sparse"),
            std::string::npos);
}

}  // namespace
}  // namespace alidade
