// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <cmath>

#include "alidade/experiment/estimator_plugin.h"
#include "alidade/experiment/run.h"
#include "batch_fixture.h"

namespace alidade {
namespace {

using testing::AddSensor;
using testing::FrameAt;
using testing::MakeBatch;
using testing::Shipped;

struct Solution {
  std::vector<Eigen::VectorXd> x;
  std::vector<Eigen::MatrixXd> p;
  double cost = 0.0;
};

Solution SmoothOver(const Problem& problem, const std::vector<Frame>& frames) {
  const auto batch = MakeBatch(problem);
  for (const Frame& frame : frames) batch->Process(frame);
  Solution found;
  batch->Smooth([&](std::size_t, const State& state, const UpdateReport& report) {
    found.x.emplace_back(Eigen::VectorXd::Map(state.values().data(), std::ssize(state.values())));
    found.p.push_back(state.covariance().Dense());
    if (report.events.empty()) return;
    EXPECT_NE(report.events[0].text.find("converged"), std::string::npos);
    EXPECT_EQ(std::sscanf(report.events[0].text.c_str(), "cost %lf", &found.cost), 1);
  });
  EXPECT_FALSE(batch->failed());
  return found;
}

// ---- one element, over time ---------------------------------------------------------------------

constexpr double kGain = 2.0, kSigma = 0.3, kAcceleration = 0.7, kStep = 0.05;

/// Returns the problem of a moving point with a linear sensor. The priors are p.x ~ N(1, 2^2) and
/// p.v ~ N(-0.5, 3^2).
Problem PointWith(const RobustLoss& loss) {
  Problem problem = testing::MovingPoint(kAcceleration);
  AddSensor(problem, "z", testing::LinearSensor(kGain, kSigma), {"p.x"});
  problem.sensors[0].loss = loss;
  return problem;
}

/// Returns frames that measure 2 cos t with an oscillating error of 0.3. Every ninth value is an
/// outlier, off by 4.
std::vector<Frame> FramesWithOutliers(int count) {
  std::vector<Frame> frames;
  for (int k = 0; k < count; ++k) {
    const double wobble = 0.3 * std::sin(37.0 * k), outlier = k % 9 == 5 ? 4.0 : 0.0;
    frames.push_back(FrameAt(kStep * k, {{0, 2.0 * std::cos(kStep * k) + wobble + outlier}}));
  }
  return frames;
}

/// Solves iteratively reweighted least squares by normal equations. The unknowns u are the two
/// deviations from the mean of the prior, and the acceleration of each step. All unknowns are
/// scaled to N(0, 1): x_k = c_k + M_k u.
Solution Reweighted(const RobustLoss& loss, const std::vector<Frame>& frames) {
  const auto count = std::ssize(frames), n = count + 1;
  std::vector<Eigen::MatrixXd> m;
  std::vector<Eigen::VectorXd> c;
  Eigen::MatrixXd to_x = Eigen::MatrixXd::Zero(2, n);
  to_x(0, 0) = 2.0;
  to_x(1, 1) = 3.0;
  Eigen::Vector2d centre(1.0, -0.5);
  for (Eigen::Index k = 0; k < count; ++k) {
    if (k > 0) {
      to_x.row(0) += kStep * to_x.row(1);
      centre(0) += kStep * centre(1);
      to_x.col(k + 1) = kAcceleration * Eigen::Vector2d(0.5 * kStep * kStep, kStep);
    }
    m.push_back(to_x);
    c.emplace_back(centre);
  }
  Eigen::VectorXd u = Eigen::VectorXd::Zero(n);
  Solution solution;
  Eigen::MatrixXd information;
  for (int iteration = 0; iteration < 1000; ++iteration) {
    information.setIdentity(n, n);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
    solution.cost = 0.5 * u.squaredNorm();
    for (std::size_t k = 0; k < frames.size(); ++k) {
      const Eigen::VectorXd h = kGain / kSigma * m[k].row(0).transpose();
      const double z = (frames[k].measurements[0].values[0] - kGain * c[k](0)) / kSigma;
      const double d = std::abs(z - h.dot(u)), w = Weight(loss, d);
      solution.cost += Rho(loss, d);
      information += w * h * h.transpose();
      right += w * z * h;
    }
    u = information.ldlt().solve(right);
  }
  const Eigen::MatrixXd p = information.ldlt().solve(Eigen::MatrixXd::Identity(n, n));
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto i = static_cast<std::size_t>(k);
    solution.x.emplace_back(c[i] + m[i] * u);
    solution.p.emplace_back(m[i] * p * m[i].transpose());
  }
  return solution;
}

// Compares the batch with an independent solution of the same problem. 7 of the 60 measurements are
// outliers of 13 sigma.
TEST(CeresBatchLoss, EqualsIterativelyReweightedLeastSquares) {
  const std::vector<Frame> frames = FramesWithOutliers(60);
  const double plain = SmoothOver(PointWith({}), frames).x[5](0);
  for (const RobustLoss loss : {RobustLoss{LossKind::kHuber, 1.345}, {LossKind::kCauchy, 2.4}}) {
    SCOPED_TRACE(ToString(loss.kind));
    const Solution found = SmoothOver(PointWith(loss), frames);
    const Solution expected = Reweighted(loss, frames);
    ASSERT_EQ(found.x.size(), frames.size());
    for (std::size_t k = 0; k < frames.size(); ++k) {
      EXPECT_LT((found.x[k] - expected.x[k]).cwiseAbs().maxCoeff(), 1e-9) << k;
      EXPECT_LT((found.p[k] - expected.p[k]).cwiseAbs().maxCoeff(), 1e-9) << k;
    }
    EXPECT_NEAR(found.cost, expected.cost, 1e-8 * expected.cost);  // nine digits are printed
    EXPECT_GT(std::abs(found.x[5](0) - plain), 0.05);              // the loss has an effect
  }
}

// The estimate of the last frame is the same in the smoothing mode and in the filtering mode.
TEST(CeresBatchLoss, OfTheDataSoFarEndsWhereTheSmootherDoes) {
  const Problem problem = PointWith({LossKind::kHuber, 1.345});
  const std::vector<Frame> frames = FramesWithOutliers(30);
  const auto batch = MakeBatch(problem, "mode: filtering\n");
  for (const Frame& frame : frames) batch->Process(frame);
  const Solution smoothed = SmoothOver(problem, frames);
  EXPECT_NEAR(testing::ValueOf(batch->state(), "p.x"), smoothed.x.back()(0), 1e-8);
  EXPECT_NEAR(testing::CovarianceOf(batch->state(), "p.x", "p.v"), smoothed.p.back()(0, 1), 1e-8);
}

// Two contradictory values cost 1e11 for every position of the point. The solver therefore ends
// early, when the cost falls by less than 1e-14 of its value. The weights have to settle
// afterwards.
TEST(CeresBatchLoss, WeightsThatDoNotSettleAreSaid) {
  Problem problem = PointWith({LossKind::kHuber, 0.3});
  testing::AddMotion(problem, "c", testing::ConstantMotion(1), {{"x", 0.0, 1.0}});
  AddSensor(problem, "y", testing::LinearSensor(1.0, 0.3), {"c.x"});
  std::vector<Frame> frames = FramesWithOutliers(60);
  frames[0].measurements.push_back({frames[0].timestamp, 1, -1, {1e5}, {}});
  frames[1].measurements.push_back({frames[1].timestamp, 1, -1, {-1e5}, {}});
  std::vector<std::string> said;
  const auto last_of = [&](const std::string& options) {
    const auto batch = MakeBatch(problem, options);
    double x = 0.0;
    const auto note = [&](const State& state, const UpdateReport& report) {
      x = testing::ValueOf(state, "p.x");
      said.clear();
      for (const Event& event : report.events)
        said.push_back(std::string(ToString(event.kind)) + ": " + event.text);
    };
    for (const Frame& frame : frames) note(batch->state(), batch->Process(frame));
    if (batch->offline()) {
      batch->Smooth([&](std::size_t, const State& state, const UpdateReport& report) {
        note(state, report);
      });
    }
    EXPECT_FALSE(batch->failed());
    return x;
  };
  const double settled = last_of("max_iterations: 200\n");
  EXPECT_EQ(said.size(), 1u) << said.front();
  const auto expect_said = [&] {
    ASSERT_FALSE(said.empty());
    double left = 0.0;
    const char* const words =
        "not_converged: the weights of the losses did not settle in 12 steps: the next one is %lf";
    EXPECT_EQ(std::sscanf(said[0].c_str(), words, &left), 1) << said[0];
    EXPECT_GT(left, 1e-6);
    EXPECT_LT(left, 1e-1);
    EXPECT_TRUE(said[0].ends_with("sigma long; a larger max_iterations (12 here) may do"));
  };
  const double early = last_of("max_iterations: 12\n");
  expect_said();
  EXPECT_NE(early, settled);
  EXPECT_NEAR(early, settled, 1e-2);
  last_of("max_iterations: 12\nmode: filtering\n");
  expect_said();
}

// The square of the residual overflows, so the cost is not finite.
TEST(CeresBatchLoss, AResidualWithoutAFiniteSquareIsNoSolution) {
  const Problem problem = PointWith({LossKind::kCauchy, 2.0});
  const Config config = Config::FromText("type: ceres_batch", "batch.yaml");
  const auto batch = CreateEstimator(Shipped(), "ceres_batch", config.root())(
      problem, testing::StreamsOf(problem));
  double t_s = 0.0;
  for (const double z : {1.0, 1e160, 1.2}) batch->Process(FrameAt(t_s += 0.1, {{0, z}}));
  std::string said;
  try {
    batch->Smooth([&](std::size_t, const State&, const UpdateReport& report) {
      for (const Event& event : report.events) said += event.text;
    });
  } catch (const Error& error) {
    said += error.what();
  }
  EXPECT_TRUE(batch->failed());
  EXPECT_NE(said.find("not converged, the cost is not finite: a measurement lies too far out; "
                      "`use: {accepted_by: FILTER}` leaves out what a filter gates"),
            std::string::npos)
      << said;
}

// ---- several elements ---------------------------------------------------------------------------

struct StillPair : Motion<0, Vec<2>> {
  static constexpr std::array kBlocks{Quantity{"x"}};
  bool Stationary() const { return true; }
  template <class T>
  void Step(const T* x, const T*, double, T* next) const {
    std::copy_n(x, 2, next);
  }
  void SqrtQ(double, MatrixRef) const {}
};
struct DirectPair : Sensor<Vec<2>, Vec<2>> {
  static constexpr std::array kRoles{Quantity{"x"}};
  static constexpr Quantity kMeasurement{"z"};
  template <class T>
  bool Predict(const T* x, T* z) const {
    std::copy_n(x, 2, z);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = l[3] = T(1.0);
  }
};

// The loss applies to d^2 = r' R^-1 r of both elements together. Each measurement has a correlated
// R.
TEST(CeresBatchLoss, IsOnTheWholeWhitenedResidual) {
  const RobustLoss loss{LossKind::kHuber, 1.5};
  Problem problem;
  const SharedMotion still = MakeMotion(StillPair(), "still");
  const BlockId id = problem.layout.Declare("p.x", "p", still->blocks()[0]);
  problem.motions.push_back({"p", still, {id}});
  problem.priors.push_back({id, {0.0, 0.0}, 4.0 * Eigen::Matrix2d::Identity(), ""});
  AddSensor(problem, "z", MakeSensor(DirectPair(), "pair"), {"p.x"});
  problem.sensors[0].loss = loss;
  const std::vector<Eigen::Vector2d> z = {{1.0, 2.0}, {1.4, 1.8}, {0.8, 2.3}, {4.0, 3.5}};
  std::vector<Frame> frames;
  Eigen::Matrix2d r;
  r << 0.25, 0.15, 0.15, 0.16;
  for (std::size_t k = 0; k < z.size(); ++k) {
    Measurement m{TimestampFromSeconds(double(k)), 0, -1, {z[k](0), z[k](1)}, {}};
    m.covariance = {r(0, 0), r(0, 1), r(1, 0), r(1, 1)};
    frames.push_back({m.timestamp, {m}});
  }
  const Eigen::Matrix2d inverse = r.llt().solve(Eigen::Matrix2d::Identity());
  Eigen::Vector2d x = Eigen::Vector2d::Zero();
  Eigen::Matrix2d information;
  for (int iteration = 0; iteration < 1000; ++iteration) {
    information = 0.25 * Eigen::Matrix2d::Identity();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& one : z) {
      const double w = Weight(loss, std::sqrt((one - x).dot(inverse * (one - x))));
      information += w * inverse;
      right += w * inverse * one;
    }
    x = information.llt().solve(right);
  }
  const Solution found = SmoothOver(problem, frames);
  EXPECT_LT((found.x[0] - x).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((found.p[0] * information - Eigen::Matrix2d::Identity()).cwiseAbs().maxCoeff(), 1e-8);
}

// ---- a run --------------------------------------------------------------------------------------

/// A source in which every eighth value of each stream is an outlier. Outliers are too large by 20
/// px in one stream, and by a fifth in the other stream.
class WithOutliers : public Source {
 public:
  explicit WithOutliers(std::unique_ptr<Source> source) : source_(std::move(source)) {}
  const std::vector<StreamInfo>& streams() const override { return source_->streams(); }
  const std::vector<StreamInfo>& truths() const override { return source_->truths(); }
  bool Next(SourceFrame& frame) override {
    if (!source_->Next(frame)) return false;
    for (Measurement& m : frame.measurements) {
      if (++count_ % 8 == 0) m.values[0] += streams()[m.stream].name == "disparity" ? 20.0 : 0.2;
    }
    return true;
  }

 private:
  std::unique_ptr<Source> source_;
  int count_ = 0;
};

/// Returns the RMSE of the depth, in m, of an ekf without a gate and of the batch, in example 05
/// with outliers.
std::vector<double> DepthErrors(bool robust) {
  Config config = Config::FromFile(ALIDADE_SOURCE_DIR "/examples/05_depth_principled/config.yaml");
  config.Set("estimators", "{ekf: {type: ekf}, batch: {type: ceres_batch}}", "--set");
  if (robust) {
    config.Set("sensors.scale.loss", "{huber: 1.345}", "--set");
    config.Set("sensors.stereo.loss", "{cauchy: 3}", "--set");
  }
  Experiment experiment = BuildExperiment(config, Shipped());
  experiment.source = std::make_unique<WithOutliers>(std::move(experiment.source));
  const RunResult run = alidade::Run(experiment, {});
  EXPECT_EQ(run.status, RunStatus::kOk) << run.reason;
  std::vector<double> errors;
  for (const auto& one : run.estimators) {
    EXPECT_FALSE(one.diverged) << one.name;
    errors.push_back(one.metrics.at("rmse:target.depth"));
  }
  return errors;
}

// State-dependent noise also settles together with a loss.
TEST(CeresBatchLoss, OfAConfigServesFilterAndBatch) {
  const std::vector<double> plain = DepthErrors(false), robust = DepthErrors(true);
  // Measured RMSE without and with the loss: ekf 26.5 and 6.0 mm, batch 25.7 and 3.7 mm.
  EXPECT_LT(robust[0], 0.5 * plain[0]);
  EXPECT_LT(robust[1], 0.2 * plain[1]);
}

}  // namespace
}  // namespace alidade
