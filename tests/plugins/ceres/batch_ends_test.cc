// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "alidade/base/random.h"
#include "alidade/estimation/rts.h"
#include "alidade/experiment/run.h"
#include "batch_fixture.h"
#include "support/comma_locale.h"
#include "support/landmark_models.h"

/// Tests the start and the end of a batch, and the reports of a batch that does not reach the
/// optimum.
namespace alidade {
namespace {

using testing::AddSensor;
using testing::FrameAt;
using testing::LinearSystem;
using testing::MakeBatch;
using testing::Shipped;

// The first frame does not measure the velocity. The variance of the velocity is therefore the one
// after the step from the start to the first frame.
TEST(CeresBatchEnds, StartsAtTheGivenTime) {
  const Problem problem = LinearSystem();
  const auto so_far = MakeBatch(problem, "mode: filtering\n"), batch = MakeBatch(problem);
  Ekf ekf(problem, {}, testing::StreamsOf(problem));
  const Frame frame = FrameAt(1.0, {{0, 1.0}});
  for (Estimator* one : {so_far.get(), batch.get(), static_cast<Estimator*>(&ekf)}) {
    one->Start(0);
    one->Process(frame);
  }
  const auto expect_equal = [&](const State& found) {
    EXPECT_NEAR(testing::CovarianceOf(found, "p.v", "p.v"),
                testing::CovarianceOf(ekf.state(), "p.v", "p.v"), 1e-9);
    EXPECT_NEAR(testing::ValueOf(found, "p.x"), testing::ValueOf(ekf.state(), "p.x"), 1e-9);
  };
  expect_equal(so_far->state());
  batch->Smooth([&](std::size_t, const State& state, const UpdateReport&) { expect_equal(state); });
}

// A dense system may have 4000 inputs: 1 for p.v, 1 for p.x and 3998 for the steps. The input for
// the initial value of c.x exceeds the limit.
TEST(CeresBatchEnds, InputsOfFirstValuesCountToo) {
  Problem problem = LinearSystem();
  testing::AddMotion(problem, "c", testing::ConstantMotion(1), {{"x", 0.0, 1.0}});
  AddSensor(problem, "y", testing::LinearSensor(1.0, 0.3), {"c.x"});
  problem.priors.back().sensor = "y";
  const auto process = [&](const std::vector<std::pair<int, double>>& values, bool fails) {
    const auto batch = MakeBatch(problem, "solver: dense\nmax_dt_s: 0.001\n");
    batch->Process(FrameAt(0.0, {}));
    const UpdateReport& report = batch->Process(FrameAt(3.998, values));
    EXPECT_EQ(batch->failed(), fails);
    ASSERT_FALSE(report.events.empty());
    EXPECT_EQ(report.events[0].text.find("more than 4000 noise inputs: the batch") == 0, fails)
        << report.events[0].text;
  };
  process({}, false);
  process({{1, 0.5}}, true);
}

TEST(CeresBatchEnds, TimesReadTheSameInEveryLocale) {
  const testing::CommaLocale locale;
  if (!locale.active()) GTEST_SKIP() << "localedef is not available";
  const auto batch = MakeBatch(LinearSystem(), "max_dt_s: 0.001\n");
  batch->Process(FrameAt(0.0, {}));
  const UpdateReport& report = batch->Process(FrameAt(1010.5, {}));
  ASSERT_FALSE(report.events.empty());
  EXPECT_EQ(report.events[0].text,
            "the gap that ends at t = 1010.500000 s needs more than 4000 steps; increase max_dt_s");
}

// ---- a model that fails -------------------------------------------------------------------------

/// Motion model of a random walk that fails after `budget` steps.
struct Failing : Motion<1, Vec<1>> {
  static constexpr std::array kBlocks{Quantity{"x", "m"}};
  static inline int budget = 0;
  template <class T>
  bool Step(const T* x, const T* w, double dt_s, T* next) const {
    if (budget-- <= 0) return false;
    next[0] = x[0] + w[0] * dt_s;
    return true;
  }
  void SqrtQ(double, MatrixRef l) const { l(0, 0) = 1.0; }
};

/// Expects that the batch reports a failure if the model fails after `budget` steps.
void ExpectSaid(const Problem& problem, int budget, bool so_far) {
  Failing::budget = budget;
  const auto batch = MakeBatch(problem, so_far ? "mode: filtering\n" : "");
  std::string said;
  const auto note = [&](const UpdateReport& report) {
    for (const Event& event : report.events) said += event.text;
  };
  for (int k = 0; k < 4; ++k) note(batch->Process(FrameAt(0.1 * k, {{0, 0.2 * k}})));
  try {
    const auto emit = [&](std::size_t, const State&, const UpdateReport& report) { note(report); };
    if (batch->offline()) batch->Smooth(emit);
  } catch (const Error& e) {
    said += e.what();
  }
  EXPECT_TRUE(batch->failed()) << budget << ' ' << said;
  EXPECT_NE(said.find("motion model of 'p' cannot predict the state: the state is outside the "
                      "domain of the model"),
            std::string::npos)
      << budget << ' ' << said;
}

TEST(CeresBatchEnds, AModelThatFailsAtTheEndIsSaid) {
  constexpr int kMany = 1'000'000;
  Problem problem;
  testing::AddMotion(problem, "p", MakeMotion(Failing(), "failing"), {{"x", 0.0, 2.0}});
  AddSensor(problem, "z", testing::LinearSensor(2.0, 0.3), {"p.x"});
  for (const bool so_far : {false, true}) {
    Failing::budget = kMany;
    const auto batch = MakeBatch(problem, so_far ? "mode: filtering\n" : "");
    for (int k = 0; k < 4; ++k) batch->Process(FrameAt(0.1 * k, {{0, 0.2 * k}}));
    if (!so_far) batch->Smooth([](std::size_t, const State&, const UpdateReport&) {});
    ASSERT_FALSE(batch->failed());
    // The last nine steps are made at the solution: three for the noise, three for the covariances
    // and three for the estimates.
    const int steps = kMany - Failing::budget;
    for (int missing = 1; missing <= 9; ++missing) ExpectSaid(problem, steps - missing, so_far);
  }
}

// The filter of the batch cannot step to the second frame, but the batch can make this step later.
// The block that waits for its initial value never receives one. The events report the end of the
// filter once.
TEST(CeresBatchEnds, ThatItsFilterEndedIsSaid) {
  Problem problem;
  testing::AddMotion(problem, "p", MakeMotion(Failing(), "failing"), {{"x", 0.0, 2.0}});
  testing::AddMotion(problem, "c", testing::ConstantMotion(1), {{"x", 0.0, 1.0}});
  AddSensor(problem, "z", testing::LinearSensor(2.0, 0.3), {"p.x"});
  AddSensor(problem, "y", testing::LinearSensor(1.0, 0.3), {"c.x"});
  problem.priors.back().sensor = "y";
  const auto batch = MakeBatch(problem);
  Failing::budget = 0;
  std::vector<std::string> said;
  for (int k = 0; k < 4; ++k) {
    const Frame frame =
        k == 0 ? FrameAt(0.0, {{0, 0.0}}) : FrameAt(0.1 * k, {{0, 0.2 * k}, {1, 0.5}});
    for (const Event& event : batch->Process(frame).events) said.push_back(event.text);
    if (k == 1) Failing::budget = 1000;
  }
  ASSERT_EQ(said.size(), 1u);
  EXPECT_EQ(said[0].find("the filter that the batch starts from, and that gives blocks their first "
                         "values, ended: the motion model of 'p' cannot predict the state: the "
                         "state is outside the domain of the model"),
            0u)
      << said[0];
  std::vector<Outcome> outcomes;
  batch->Smooth([&](std::size_t, const State&, const UpdateReport& report) {
    for (const MeasurementReport& entry : report.measurements()) outcomes.push_back(entry.outcome);
  });
  EXPECT_FALSE(batch->failed());
  EXPECT_EQ(std::ranges::count(outcomes, Outcome::kAccepted), 4);
  EXPECT_EQ(std::ranges::count(outcomes, Outcome::kNotReady), 3);
}

// The batch omits measurements that its filter could not predict. Landmark 1 lies behind the
// camera.
TEST(CeresBatchEnds, LandmarksOutOfTheDomainAreLeftOut) {
  LandmarkOptions options = testing::WithPrior();
  options.known = {{1, {0.0, 0.0, -1.0}, 0.1}, {2, {0.0, 0.0, 2.0}, 0.1}};
  const Problem problem = testing::MapSystem(testing::InverseDepthPixels(0.01), options, 0.1);
  const auto batch = MakeBatch(problem);
  for (int k = 0; k < 3; ++k) {
    batch->Process(testing::FrameOf(0.1 * k, {{1, {0.0, 0.0}}, {2, {0.01, 0.0}}}));
  }
  std::vector<Outcome> outcomes;
  batch->Smooth([&](std::size_t, const State&, const UpdateReport& report) {
    for (const MeasurementReport& one : report.measurements()) outcomes.push_back(one.outcome);
  });
  EXPECT_FALSE(batch->failed());
  ASSERT_EQ(outcomes.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(outcomes[i], i % 2 == 0 ? Outcome::kOutOfDomain : Outcome::kAccepted);
  }
}

// After a gap that is too long the batch cannot continue. Later frames change nothing.
TEST(CeresBatchEnds, ARefusedFrameIsTheLast) {
  for (const bool so_far : {false, true}) {
    const auto batch = MakeBatch(
        LinearSystem(), std::string("max_dt_s: 0.001\n") + (so_far ? "mode: filtering\n" : ""));
    batch->Process(FrameAt(0.0, {{0, 1.0}}));
    EXPECT_EQ(batch->Process(FrameAt(1000.0, {{0, 1.0}})).events.empty(), false);
    EXPECT_TRUE(batch->failed());
    EXPECT_TRUE(batch->Process(FrameAt(0.001, {{0, 1.0}})).events.empty());
    EXPECT_TRUE(batch->failed());
    if (!batch->offline()) continue;
    EXPECT_THROW(batch->Smooth([](std::size_t, const State&, const UpdateReport&) {}), Error);
  }
}

// After the end of its filter the batch also omits landmark measurements that it could have
// predicted.
TEST(CeresBatchEnds, LandmarksSeenAfterItsFilterEndedAreLeftOut) {
  Problem problem = testing::MapSystem(testing::Offset(0.1), {}, 0.3);
  testing::AddMotion(problem, "p", MakeMotion(Failing(), "failing"), {{"x", 0.0, 2.0}});
  for (const bool ends : {false, true}) {
    const auto batch = MakeBatch(problem);
    Failing::budget = ends ? 0 : 1000;
    for (int k = 0; k < 3; ++k) {
      batch->Process(testing::FrameOf(0.1 * k, {{7, {1.0, 0.0, 2.0}}}));
      if (k == 1) Failing::budget = 1000;
    }
    std::vector<Outcome> outcomes;
    batch->Smooth([&](std::size_t, const State&, const UpdateReport& report) {
      outcomes.push_back(report.measurements()[0].outcome);
    });
    const Outcome later = ends ? Outcome::kEnded : Outcome::kAccepted;
    EXPECT_EQ(outcomes, (std::vector{Outcome::kInitialised, later, later}));
  }
}

// The filter ends at its last good state, and reports the end once.
TEST(CeresBatchEnds, AFilterThatGaveUpStepsNoMore) {
  Problem problem;
  testing::AddMotion(problem, "p", MakeMotion(Failing(), "failing"), {{"x", 0.0, 2.0}});
  AddSensor(problem, "z", testing::LinearSensor(2.0, 0.3), {"p.x"});
  Ekf ekf(problem, {}, testing::StreamsOf(problem));
  ekf.Process(FrameAt(0.0, {{0, 0.2}}));
  const std::vector<double> good = ekf.state().values();
  const Eigen::MatrixXd p = ekf.state().covariance().Dense();
  Failing::budget = 0;
  ekf.Process(FrameAt(0.1, {{0, 0.2}}));
  EXPECT_TRUE(ekf.failed());
  Failing::budget = 1000;
  const UpdateReport& report = ekf.Process(FrameAt(0.2, {{0, 0.2}}));
  EXPECT_TRUE(report.events.empty());
  EXPECT_EQ(report.measurements()[0].outcome, Outcome::kEnded);
  EXPECT_EQ(ekf.timestamp(), 0);
  EXPECT_EQ(ekf.state().values(), good);
  EXPECT_EQ(ekf.state().covariance().Dense(), p);
}

TEST(CeresBatchEnds, TooFewIterationsNameTheKeyThatAllowsMore) {
  Problem problem = testing::MovingPoint(0.7);
  AddSensor(problem, "z", testing::LinearSensor(2.0, 0.3), {"p.x"});
  problem.sensors[0].loss = {LossKind::kHuber, 0.1};
  const auto batch = MakeBatch(problem, "max_iterations: 2\n");
  for (int k = 0; k < 20; ++k) batch->Process(FrameAt(0.05 * k, {{0, 4.0 + k % 3}}));
  std::string said;
  batch->Smooth([&](std::size_t, const State&, const UpdateReport& report) {
    for (const Event& event : report.events) said += event.text;
  });
  EXPECT_TRUE(batch->failed());
  EXPECT_NE(said.find("not converged, Maximum number of iterations reached. Number of iterations: "
                      "2. A larger max_iterations (2 here) may do."),
            std::string::npos)
      << said;
}

/// Sensor z = x^2, whose Jacobian can have the wrong sign.
struct WrongSign : Sensor<Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"x", "m"}};
  static constexpr Quantity kMeasurement{"z", "m2"};
  double sign = -1.0;
  explicit WrongSign(double s) : sign(s) {}
  template <class T>
  bool Predict(const T* x, T* z) const {
    z[0] = x[0] * x[0];
    return true;
  }
  void Jacobian(const double* x, MatrixRef j) const { j(0, 0) = sign * 2.0 * x[0]; }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(0.1);
  }
};

TEST(CeresBatchEnds, AWrongJacobianIsNotConvergence) {
  for (const double sign : {1.0, -1.0}) {
    Problem problem = testing::MovingPoint(0.7);
    AddSensor(problem, "z", MakeSensor(WrongSign(sign), "square"), {"p.x"});
    const auto batch = MakeBatch(problem, "max_iterations: 500\n");
    for (int k = 0; k < 20; ++k) batch->Process(FrameAt(0.05 * k, {{0, 4.0 + 0.1 * k}}));
    std::string said;
    batch->Smooth([&](std::size_t, const State&, const UpdateReport& report) {
      for (const Event& event : report.events) said += event.text;
    });
    EXPECT_EQ(batch->failed(), sign < 0.0) << said;
    const char* words = sign < 0.0 ? "not converged: no step lowers the cost although the gradient "
                                     "is not zero; check the models' Jacobians with alidade check"
                                   : ": converged";
    EXPECT_NE(said.find(words), std::string::npos) << said;
  }
}

// A loss requires further steps after the end of the solver. These steps never raise the cost. If
// the scale of the loss exceeds all residuals, the estimates remain those without a loss.
TEST(CeresBatchEnds, ALossTakesNoStepUphill) {
  const auto last_of = [](const RobustLoss& loss) {
    Problem problem = testing::MovingPoint(0.7);
    AddSensor(problem, "z", MakeSensor(WrongSign(-1.0), "square"), {"p.x"});
    problem.sensors[0].loss = loss;
    const auto batch = MakeBatch(problem, "max_iterations: 500\n");
    for (int k = 0; k < 20; ++k) batch->Process(FrameAt(0.05 * k, {{0, 4.0 + 0.1 * k}}));
    std::pair<double, std::string> last;
    batch->Smooth([&](std::size_t, const State& state, const UpdateReport& report) {
      last.first = testing::ValueOf(state, "p.x");
      for (const Event& event : report.events)
        last.second += std::string(ToString(event.kind)) + ": " + event.text + '\n';
    });
    EXPECT_TRUE(batch->failed());
    return last;
  };
  const auto [expected, none] = last_of({});
  const auto [found, said] = last_of({LossKind::kHuber, 1e9});
  EXPECT_NEAR(found / expected, 1.0, 1e-4) << said;  // both are about 1e8, rounded to 1e-4
  EXPECT_EQ(said.find("not_converged: the weights of the losses did not settle in 0 steps: "), 0u)
      << said;
  EXPECT_NE(said.find("it does not lower the cost\n"), std::string::npos) << said;
}

// ---- the seam of a unit vector ------------------------------------------------------------------

constexpr double kSigma = 2e-3;  // rad

/// Motion model of a random walk n' = n (+) w.
struct Wander : Motion<2, UnitVector> {
  static constexpr std::array kBlocks{Quantity{"n", "", "", "x,y,z"}};
  template <class T>
  void Step(const T* n, const T* w, double, T* next) const {
    UnitVector::Plus(n, w, next);
  }
  void SqrtQ(double, MatrixRef l) const { l(0, 0) = l(1, 1) = kSigma; }
};
struct Seen : Sensor<UnitVector, UnitVector> {
  static constexpr std::array kRoles{Quantity{"n", "", "", "x,y,z"}};
  static constexpr Quantity kMeasurement{"z", "", "", "x,y,z"};
  template <class T>
  bool Predict(const T* n, T* z) const {
    std::copy_n(n, 3, z);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = l[3] = T(kSigma);
  }
};

// The tangent basis changes at z = 0, which this walk crosses. The smoother linearises at the
// estimates of the filter, so it differs from the batch. At z = 0.6, far from the change, the two
// also differ: by 5e-6 sigma, and by up to 8e-4 in P.
TEST(CeresBatchEnds, AUnitVectorMayCrossTheSeamOfItsBasis) {
  Problem problem;
  const SharedMotion wander = MakeMotion(Wander(), "wander");
  const BlockId id = problem.layout.Declare("d.n", "d", wander->blocks()[0]);
  problem.motions.push_back({"d", wander, {id}});
  const std::vector<double> mean = {std::sqrt(1.0 - 0.0005), 0.02, 0.01};
  const Eigen::Matrix2d p = (Eigen::Matrix2d() << 1e-5, 2e-6, 2e-6, 4e-6).finished();
  problem.priors.push_back({id, mean, p, ""});
  AddSensor(problem, "z", MakeSensor(Seen(), "seen"), {"d.n"});
  const auto batch = MakeBatch(problem), so_far = MakeBatch(problem, "mode: filtering\n");
  RtsSmoother rts(problem, {}, testing::StreamsOf(problem));
  Random random(3);
  const auto drawn = [&](std::vector<double> x) {
    const double d[2] = {kSigma * random.Normal(), kSigma * random.Normal()};
    UnitVector::Plus(std::vector<double>(x).data(), d, x.data());
    return x;
  };
  std::vector<double> x = mean;
  int crossings = 0;
  for (int k = 0; k < 60; ++k) {
    const double before = x[2];
    x = drawn(x);
    crossings += before * x[2] < 0.0;
    Frame frame = FrameAt(0.1 * k, {});
    const std::vector<double> z = drawn(x);
    if (k % 4 != 1) frame.measurements.push_back({frame.timestamp, 0, -1, z, {}});
    rts.Process(frame);
    batch->Process(frame);
    if (k < 30) so_far->Process(frame);
    EXPECT_FALSE(so_far->failed()) << k;
  }
  ASSERT_GE(crossings, 1);
  std::vector<State> smoothed;
  rts.Smooth(
      [&](std::size_t, const State& state, const UpdateReport&) { smoothed.push_back(state); });
  std::string said;
  batch->Smooth([&](std::size_t k, const State& state, const UpdateReport& report) {
    for (const Event& event : report.events) said += event.text;
    double d[2];
    UnitVector::Minus(state.value(0), smoothed[k].value(0), d);
    const double sigma = std::sqrt(smoothed[k].covariance().Dense().trace());
    EXPECT_LT(std::hypot(d[0], d[1]), 1e-4 * sigma) << k;
    EXPECT_NEAR(state.covariance().Dense().trace() / (sigma * sigma), 1.0, 3e-3) << k;
  });
  EXPECT_FALSE(batch->failed()) << said;
  EXPECT_NE(said.find(": converged"), std::string::npos) << said;
}

// ---- stopped ------------------------------------------------------------------------------------

// Example 05 has 152 frames. The batch checks for a stop request after each frame.
TEST(CeresBatchEnds, AStopWhileItSolvesKeepsTheOthers) {
  Config config = Config::FromFile(ALIDADE_SOURCE_DIR "/examples/05_depth_principled/config.yaml");
  config.Set("estimators.batch", "{type: ceres_batch}", "--set");
  config.Set("estimators.rts", "{type: rts}", "--set");
  for (const int after : {152, 155}) {
    Experiment experiment = BuildExperiment(config, Shipped());
    int asked = 0;
    RunOptions options;
    options.stop = [&] { return ++asked > after; };
    const RunResult run = alidade::Run(experiment, options);
    EXPECT_EQ(run.status, RunStatus::kStopped);
    EXPECT_EQ(run.code, ExitCode::kStopped);
    EXPECT_EQ(run.reason, "estimator 'batch': stopped while the batch was solved");
    EXPECT_EQ(run.frames, 152);
    EXPECT_LE(asked, after + 2);
    ASSERT_EQ(run.estimators.size(), 3u);
    EXPECT_EQ(run.estimators[1].metrics.count("rmse:target.depth"), 0u);
    EXPECT_FALSE(run.estimators[1].diverged);
    EXPECT_TRUE(std::ranges::any_of(run.estimators[1].events, [](const Event& event) {
      return event.kind == EventKind::kStopped;
    }));
    EXPECT_EQ(run.estimators[0].metrics.count("rmse:target.depth"), 1u);
    EXPECT_EQ(run.estimators[2].metrics.count("rmse:target.depth"), 1u);
  }
}

}  // namespace
}  // namespace alidade
