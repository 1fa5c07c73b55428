// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/run.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "alidade/base/random.h"
#include "support/driven.h"
#include "support/recording.h"

namespace alidade {
namespace {

using testing::MakeExperiment;

/// Motion model whose value becomes infinite in the first step.
struct Exploding : Motion<1, Vec<1>> {
  static constexpr std::array kBlocks{Quantity{"x"}};
  template <class T>
  void Step(const T* x, const T* w, double, T* next) const {
    next[0] = 1e308 * 10.0 * (x[0] + w[0]);
  }
  void SqrtQ(double, MatrixRef l) const { l(0, 0) = 1.0; }
};

EstimatorSpec ExplodingEstimator(const std::vector<StreamInfo>& streams) {
  EstimatorSpec named;
  named.name = "exploding";
  testing::AddMotion(named.problem, "p", MakeMotion(Exploding(), "exploding"), {{"x", 1.0, 1.0}});
  testing::AddSensor(named.problem, "disparity", testing::LinearSensor(1.0, 1.0), {"p.x"});
  named.estimator = std::make_unique<Ekf>(named.problem, EkfOptions{}, streams);
  return named;
}

TEST(Run, AnEstimatorThatCannotGoOnEndsAloneAndTheCodeSaysSo) {
  Experiment experiment = MakeExperiment();
  experiment.estimators.push_back(ExplodingEstimator(experiment.source->streams()));
  const RunResult result = alidade::Run(experiment, {});
  EXPECT_EQ(result.status, RunStatus::kFailed);
  EXPECT_EQ(result.code, ExitCode::kDiverged);
  EXPECT_NE(result.reason.find("estimator 'exploding' at t = 0.033000 s"), std::string::npos)
      << result.reason;
  EXPECT_NE(result.reason.find("last good state at 0.000000 s: p.x = "), std::string::npos);
  EXPECT_NE(result.reason.find("last measurement used: sensor 'disparity'"), std::string::npos);
  // The event also has the timestamp of the failed step.
  EXPECT_EQ(result.estimators[2].events.back().timestamp, TimestampFromSeconds(0.033));
  // The other estimators processed all frames.
  EXPECT_EQ(result.frames, 60);
  EXPECT_EQ(result.estimators[0].counts.at("accepted:inverse_scale"), 60);
}

TEST(Run, DivergenceUnderFailEndsTheRun) {
  Experiment experiment = MakeExperiment();
  EstimatorSpec& alone = experiment.estimators[1];
  alone.problem.priors[0].mean = {-0.2};
  alone.on_divergence = OnDivergence::kFail;
  alone.estimator =
      std::make_unique<Ekf>(alone.problem, EkfOptions{}, experiment.source->streams());
  const RunResult result = alidade::Run(experiment, {});
  EXPECT_EQ(result.code, ExitCode::kDiverged);
  EXPECT_EQ(result.frames, 1);
  EXPECT_NE(result.reason.find("not defined at target.depth = -0.2"), std::string::npos);
}

TEST(Run, TheReasonOfAFailureIsTheEventThatCausedIt) {
  Experiment experiment = MakeExperiment();
  EstimatorSpec& alone = experiment.estimators[1];
  alone.on_divergence = OnDivergence::kFail;
  alone.problem.priors[0].mean = {-0.2};
  EkfOptions options;
  options.rejection_recovery_after = 1;
  alone.estimator = std::make_unique<Ekf>(alone.problem, options, experiment.source->streams());
  const RunResult result = alidade::Run(experiment, {});
  ASSERT_EQ(result.code, ExitCode::kDiverged);
  const std::vector<Event>& events = result.estimators[1].events;
  EXPECT_EQ(std::ranges::count(events, EventKind::kRejectionRecovery, &Event::kind), 1);
  EXPECT_NE(result.reason.find("not defined at target.depth = -0.2"), std::string::npos)
      << result.reason;
}

/// A smoother whose depth is 1 m at the first frame and grows by 1 mm at each further frame.
struct Hindsight : Estimator {
  explicit Hindsight(const Problem& problem) : state_(problem.InitialState()) {}
  void Start(Timestamp) override {}
  const UpdateReport& Process(const Frame&) override {
    ++frames_;
    return report_;
  }
  bool offline() const override { return true; }
  void Smooth(const Emit& emit) override {
    for (std::size_t k = 0; k < frames_; ++k) {
      state_.values()[0] = 1.0 + 1e-3 * static_cast<double>(k);
      if (k + 1 == frames_)
        report_.events.push_back({kNoTimestamp, EventKind::kEstimatorSpecific, "all is known"});
      emit(k, state_, report_);
    }
  }
  const State& state() const override { return state_; }
  Timestamp timestamp() const override { return kNoTimestamp; }
  bool diverged() const override { return false; }
  bool failed() const override { return failed_; }

 protected:
  bool failed_ = false;

 private:
  State state_;
  UpdateReport report_;
  std::size_t frames_ = 0;
};

TEST(Run, TakesTheEstimatesOfAnOfflineEstimatorAtTheEnd) {
  Experiment experiment = MakeExperiment();
  EstimatorSpec& alone = experiment.estimators[1];
  alone.estimator = std::make_unique<Hindsight>(alone.problem);
  Experiment truths = MakeExperiment();
  SourceFrame frame;
  double squares = 0.0, known = 0.0;
  for (double k = 0.0; truths.source->Next(frame); ++k) {
    for (const double depth : frame.truth[0]) {
      squares += std::pow(1.0 + 1e-3 * k - depth, 2);
      ++known;
    }
  }
  const RunResult result = alidade::Run(experiment, {});
  EXPECT_EQ(result.status, RunStatus::kOk);
  EXPECT_NEAR(result.estimators[1].metrics.at("rmse:target.depth"), std::sqrt(squares / known),
              1e-12);
  const std::vector<Event>& events = result.estimators[1].events;
  EXPECT_EQ(std::ranges::count(events, "all is known", &Event::text), 1);
}

/// A smoother that fails in Smooth and has no estimate.
struct Speechless : Hindsight {
  using Hindsight::Hindsight;
  void Smooth(const Emit&) override {
    failed_ = true;
    throw Error(ExitCode::kDiverged, "no words");
  }
};

TEST(Run, AnEstimatorThatFailsSaysNothingOfItsSensors) {
  Experiment experiment = MakeExperiment();
  EstimatorSpec& alone = experiment.estimators[1];
  alone.estimator = std::make_unique<Speechless>(alone.problem);
  const RunResult result = alidade::Run(experiment, {});
  EXPECT_EQ(result.code, ExitCode::kDiverged);
  const std::vector<Event>& events = result.estimators[1].events;
  EXPECT_EQ(std::ranges::count(events, EventKind::kFailed, &Event::kind), 1);
  EXPECT_EQ(std::ranges::count(events, EventKind::kUnused, &Event::kind), 0);
}

TEST(Run, AStopIsTakenAfterTheFrame) {
  Experiment experiment = MakeExperiment();
  int frames = 0;
  RunOptions options;
  options.stop = [&] { return ++frames == 7; };
  const RunResult result = alidade::Run(experiment, options);
  EXPECT_EQ(result.status, RunStatus::kStopped);
  EXPECT_EQ(result.code, ExitCode::kStopped);
  EXPECT_EQ(result.frames, 7);
}

TEST(Run, AStopAfterAFailureIsStillAFailure) {
  Experiment experiment = MakeExperiment();
  experiment.estimators.push_back(ExplodingEstimator(experiment.source->streams()));
  int frames = 0;
  RunOptions options;
  options.stop = [&] { return ++frames == 7; };
  const RunResult result = alidade::Run(experiment, options);
  EXPECT_EQ(result.frames, 7);
  EXPECT_EQ(result.status, RunStatus::kFailed);
  EXPECT_EQ(result.code, ExitCode::kDiverged);
  EXPECT_NE(result.reason.find("estimator 'exploding'"), std::string::npos) << result.reason;
}

/// A source that is interrupted by a signal while it waits for frame 7.
struct SignalledSource : Source {
  explicit SignalledSource(std::unique_ptr<Source> of) : frames(std::move(of)) {}
  const std::vector<StreamInfo>& streams() const override { return frames->streams(); }
  const std::vector<StreamInfo>& truths() const override { return frames->truths(); }
  bool Next(SourceFrame& frame) override {
    if (++count == 7) throw Error(ExitCode::kStopped, "a signal");
    return frames->Next(frame);
  }
  std::unique_ptr<Source> frames;
  int count = 0;
};

TEST(Run, ASignalToItsSourceAfterAFailureIsStillAFailure) {
  for (const bool fails : {false, true}) {
    Experiment experiment = MakeExperiment();
    if (fails) {
      experiment.estimators.push_back(ExplodingEstimator(experiment.source->streams()));
    }
    experiment.source = std::make_unique<SignalledSource>(std::move(experiment.source));
    const RunResult result = alidade::Run(experiment, {});
    EXPECT_EQ(result.frames, 6);
    EXPECT_EQ(result.status, fails ? RunStatus::kFailed : RunStatus::kStopped);
    EXPECT_EQ(result.code, fails ? ExitCode::kDiverged : ExitCode::kStopped) << result.reason;
  }
}

/// A smoother that is interrupted by a signal.
struct Interrupted : Hindsight {
  using Hindsight::Hindsight;
  void Smooth(const Emit&) override { throw Error(ExitCode::kStopped, "a signal"); }
};

TEST(Run, AStopOfASmootherAfterAFailureIsStillAFailure) {
  const auto run = [](bool fails) {
    Experiment experiment = MakeExperiment();
    EstimatorSpec& alone = experiment.estimators[1];
    alone.estimator = std::make_unique<Interrupted>(alone.problem);
    if (fails) {
      experiment.estimators.push_back(ExplodingEstimator(experiment.source->streams()));
    }
    return alidade::Run(experiment, {});
  };
  EXPECT_EQ(run(false).code, ExitCode::kStopped);
  const RunResult failed = run(true);
  EXPECT_EQ(failed.status, RunStatus::kFailed);
  EXPECT_EQ(failed.code, ExitCode::kDiverged);
  const std::vector<Event>& events = failed.estimators[1].events;
  EXPECT_EQ(std::ranges::count(events, EventKind::kStopped, &Event::kind), 1);
}

/// A source that measures a random walk. Each second the walk makes one step N(0, 0.1^2). The noise
/// of the measurements has sigma 1.
class Walking : public testing::SwingingTarget {
 public:
  explicit Walking(std::uint64_t seed) : SwingingTarget(0), random_(seed) {
    x_ = 2.0 * random_.Normal();
  }
  bool Next(SourceFrame& frame) override {
    if (k_ == 200) return false;
    frame = {testing::FrameAt(k_++, {{0, x_ + random_.Normal()}}), {{x_}}};
    x_ += 0.1 * random_.Normal();
    return true;
  }

 private:
  Random random_;
  double x_ = 0.0;
  int k_ = 0;
};

/// Runs a filter on Walking and returns the result of the filter. The filter assumes `factor` times
/// the true standard deviations.
EstimatorResult WalkWith(double factor, std::uint64_t seed = 1) {
  Experiment experiment;
  experiment.source = std::make_unique<Walking>(seed);
  EstimatorSpec& named = experiment.estimators.emplace_back();
  named.name = "ekf";
  testing::AddMotion(named.problem, "p", testing::ConstantMotion(1, 0.1 * factor),
                     {{"depth", 0.0, 2.0 * factor}});
  testing::AddSensor(named.problem, "disparity", testing::LinearSensor(1.0, factor), {"p.depth"});
  named.estimator =
      std::make_unique<Ekf>(named.problem, EkfOptions{}, experiment.source->streams());
  return alidade::Run(experiment, {}).estimators[0];
}

std::vector<std::string> TextsOf(const EstimatorResult& result, EventKind kind) {
  std::vector<std::string> texts;
  for (const Event& event : result.events) {
    if (event.kind == kind) texts.push_back(event.text);
  }
  return texts;
}

/// Returns whether the mean NEES or NIS of a subject is outside its 95 % bounds.
bool IsOutside(const EstimatorResult& result, const std::string& name, const std::string& subject) {
  const auto value = [&](const char* part) { return result.metrics.at(name + part + subject); };
  return value(".mean:") < value(".low:") || value(".mean:") > value(".high:");
}

TEST(Run, TheVerdictOnAnOverconfidentFilterGivesItsNees) {
  const EstimatorResult result = WalkWith(0.13);
  EXPECT_GT(result.metrics.at("nees.mean:p"), 30.0);
  EXPECT_EQ(result.verdict.state, VerdictState::kOverconfident);
  EXPECT_TRUE(result.verdict.because.starts_with("the NEES of p is ")) << result.verdict.because;
  ASSERT_FALSE(result.findings.empty());
  EXPECT_TRUE(IsOutside(result, "nees", "p"));
}

TEST(Run, TheVerdictOnAnUnderconfidentFilterIsByItsInnovations) {
  const EstimatorResult result = WalkWith(4.0);
  EXPECT_EQ(result.verdict.state, VerdictState::kUnderconfident);
  EXPECT_TRUE(IsOutside(result, "nis", "disparity"));
}

// Of the 200 runs, 10 (5 %) are expected outside the bounds, with a standard deviation of 3. The
// bounds of the NEES are wider.
TEST(Run, AConsistentFilterIsRarelyOutsideItsBounds) {
  int nees = 0, nis = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const EstimatorResult result = WalkWith(1.0, seed);
    EXPECT_EQ(result.verdict.state, VerdictState::kConsistent) << result.verdict.because;
    nees += IsOutside(result, "nees", "p") ? 1 : 0;
    nis += IsOutside(result, "nis", "disparity") ? 1 : 0;
  }
  EXPECT_LE(nees, 20);
  EXPECT_LE(nis, 20);
  EXPECT_GE(nis, 2);
}

/// Measures a heading: z = x + n.
struct Compass : Sensor<Angle, Angle> {
  static constexpr std::array kRoles{Quantity{"heading", "rad"}};
  static constexpr Quantity kMeasurement{"heading", "rad"};
  template <class T>
  bool Predict(const T* x, T* z) const {
    z[0] = x[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(0.02);
  }
};

/// Motion model of a heading that performs a random walk.
struct Turn : Motion<1, Angle> {
  static constexpr std::array kBlocks{Quantity{"heading", "rad"}};
  template <class T>
  void Step(const T* x, const T* w, double, T* next) const {
    next[0] = x[0] + w[0];
  }
  void SqrtQ(double dt_s, MatrixRef l) const { l(0, 0) = 0.2 * std::sqrt(dt_s); }
};

/// A source that measures a heading ten times a second. The heading rotates at a constant rate. The
/// measurements are in rad times `unit`. If `wrapped` is true, they are wrapped to one turn.
class Turning : public testing::SwingingTarget {
 public:
  Turning(double rate_rad_s, double unit, bool wrapped)
      : SwingingTarget(0), rate_rad_s_(rate_rad_s), unit_(unit), wrapped_(wrapped) {}
  bool Next(SourceFrame& frame) override {
    if (k_ == 300) return false;
    const double t_s = 0.1 * k_++;
    const double angle = 0.6 + rate_rad_s_ * t_s + 0.02 * random_.Normal();
    frame = {testing::FrameAt(t_s, {{0, unit_ * (wrapped_ ? Angle::Wrap(angle) : angle)}})};
    return true;
  }

 private:
  double rate_rad_s_, unit_;
  bool wrapped_;
  Random random_{4};
  int k_ = 0;
};

std::vector<std::string> UnitEventsOf(const Turning& source, double gate, double mean = 0.6,
                                      double variance = 0.01) {
  Experiment experiment;
  experiment.source = std::make_unique<Turning>(source);
  EstimatorSpec& named = experiment.estimators.emplace_back();
  named.name = "ekf";
  const SharedMotion model = MakeMotion(Turn(), "turn");
  const BlockId id = named.problem.layout.Declare("car.heading", "car", model->blocks()[0]);
  named.problem.motions.push_back({"car", model, {id}});
  named.problem.priors.push_back({id, {mean}, Eigen::MatrixXd::Constant(1, 1, variance), {}});
  testing::AddSensor(named.problem, "disparity", MakeSensor(Compass(), "compass"), {"car.heading"});
  EkfOptions options;
  options.gate = gate;
  named.estimator = std::make_unique<Ekf>(named.problem, options, experiment.source->streams());
  return TextsOf(alidade::Run(experiment, {}).estimators[0], EventKind::kUnit);
}

constexpr double kDegree = 180.0 / std::numbers::pi;

TEST(Run, DegreesForRadiansAreAnEvent) {
  for (const double gate : {1.0, 0.9999}) {
    for (const double rate : {0.3, 0.05, -0.1}) {
      const std::vector<std::string> texts = UnitEventsOf(Turning(rate, kDegree, true), gate);
      ASSERT_EQ(texts.size(), 1u) << gate << ' ' << rate;
      EXPECT_EQ(
          texts[0],
          "sensor 'disparity': most measurements z and their predictions h differ by more than "
          "5 sigma, with |z - h| > pi / 4 or |z| > 2 pi; is stream 'disparity' in rad?");
    }
  }
}

// The measured heading is either wrapped to one turn or counted over several turns.
TEST(Run, RadiansAreNoEvent) {
  for (const double gate : {1.0, 0.9999}) {
    for (const double rate : {0.0, 0.3, 0.9, -0.9}) {
      for (const bool wrapped : {true, false}) {
        EXPECT_EQ(UnitEventsOf(Turning(rate, 1.0, wrapped), gate), std::vector<std::string>{})
            << gate << ' ' << rate << ' ' << wrapped;
      }
    }
  }
}

TEST(Run, AnInitialAngleBeyondARevolutionIsAnEvent) {
  const Turning source(0.3, 1.0, true);
  const auto events = [&](double mean, double sigma) {
    return UnitEventsOf(source, 1.0, mean, sigma * sigma);
  };
  EXPECT_EQ(events(90.0, 60.0), std::vector<std::string>{
                                    "the initial value of angle 'car.heading' is 90 rad +- 60 rad, "
                                    "more than a revolution; is it in deg?"});
  EXPECT_EQ(events(0.6, 30.0).size(), 1u);
  EXPECT_EQ(events(-6.3, 0.1).size(), 1u) << "2 pi is 6.283";
  EXPECT_EQ(events(-6.2, 6.2).size(), 0u);
}

TEST(Run, ARoleWithAnotherUnitThanItsBlockIsAnEvent) {
  Experiment experiment = MakeExperiment();
  EstimatorSpec& ekf = experiment.estimators[0];
  SensorBinding& scale = ekf.problem.sensors[1];
  ASSERT_EQ(scale.roles.size(), 2u);
  EXPECT_EQ(TextsOf(alidade::Run(experiment, {}).estimators[0], EventKind::kUnit).size(), 0u);
  std::swap(scale.roles[0], scale.roles[1]);
  ekf.estimator = std::make_unique<Ekf>(ekf.problem, EkfOptions{}, experiment.source->streams());
  const std::vector<std::string> texts =
      TextsOf(alidade::Run(experiment, {}).estimators[0], EventKind::kUnit);
  ASSERT_GE(texts.size(), 1u);
  EXPECT_TRUE(texts[0].ends_with("; were two roles exchanged?")) << texts[0];
}

TEST(Run, FramesBeforeTheStartEnterTheCountsAlone) {
  Experiment experiment = MakeExperiment();  // 60 frames, 33 ms apart
  EstimatorSpec& ekf = experiment.estimators[0];
  ekf.problem.initial_time_s = 49.5 * 0.033;
  ekf.estimator = std::make_unique<Ekf>(ekf.problem, EkfOptions{}, experiment.source->streams());
  const EstimatorResult late = alidade::Run(experiment, {}).estimators[0];
  EXPECT_EQ(late.counts.at("stale:inverse_scale"), 50);
  EXPECT_EQ(late.counts.at("accepted:inverse_scale"), 10);
  // The prior, 0.35 m, has an RMS error of 80 mm over the first 50 frames. After these frames only
  // the first update has a large error, 75 mm, caused by curvature. The expected RMSE is
  // sqrt(75^2 / 10) mm plus a little for the oscillation.
  EXPECT_LT(late.metrics.at("rmse:target.depth"), 0.04);
}

TEST(Run, ASensorOfWhichNothingWasUsedIsAnEvent) {
  const auto unused = [](const EstimatorResult& result) {
    std::vector<std::string> texts;
    for (const Event& event : result.events) {
      if (event.kind == EventKind::kUnused) texts.push_back(event.text);
    }
    return texts;
  };
  using Texts = std::vector<std::string>;
  Experiment experiment = MakeExperiment();
  EXPECT_EQ(unused(alidade::Run(experiment, {}).estimators[0]), Texts{});

  experiment = MakeExperiment();
  EstimatorSpec& ekf = experiment.estimators[0];
  const SharedSensor linear = testing::LinearSensor(1.0, 1.0);
  testing::AddSensor(ekf.problem, "elsewhere", linear, {"target.depth"});
  // Makes the filter certain of a wrong value.
  for (Prior& prior : ekf.problem.priors) prior.covariance *= 1e-12;
  EkfOptions options;
  options.gate = 1e-6;
  options.rejection_recovery = RejectionRecovery::kNone;
  ekf.problem.motions.clear();
  ekf.estimator = std::make_unique<Ekf>(ekf.problem, options, experiment.source->streams());
  EXPECT_EQ(unused(alidade::Run(experiment, {}).estimators[0]),
            (Texts{"sensor 'disparity': the estimator used none of 30 measurements: 30 gated",
                   "sensor 'inverse_scale': the estimator used none of 60 measurements: 60 gated",
                   "sensor 'elsewhere': stream 'elsewhere' had no measurement"}));
}

/// A source that throws an Error after five frames.
class Failing : public testing::SwingingTarget {
 public:
  explicit Failing(ExitCode code) : SwingingTarget(60), code_(code) {}
  bool Next(SourceFrame& frame) override {
    if (++count_ > 5) throw Error(code_, "rows.csv:7 d: 'x' is not a number");
    return SwingingTarget::Next(frame);
  }

 private:
  ExitCode code_;
  int count_ = 0;
};

/// A source that provides a speed and a fix once a second.
class EachSecond : public testing::SwingingTarget {
 public:
  explicit EachSecond(int frames) : SwingingTarget(0), left_(frames) {}
  bool Next(SourceFrame& frame) override {
    if (left_-- == 0) return false;
    frame = {testing::FrameAt(t_s_, {{0, t_s_}, {1, 1.0}})};
    t_s_ += 1.0;
    return true;
  }

 private:
  int left_;
  double t_s_ = 0.0;
};

// From the second step on, every input is older than its timeout. The run reports this fault with
// one event and a count.
TEST(Run, AnInputThatIsMissingAgainAndAgainIsOneEventAndACount) {
  Experiment experiment;
  experiment.source = std::make_unique<EachSecond>(100);
  EstimatorSpec& named = experiment.estimators.emplace_back();
  named.name = "ekf";
  testing::AddMotion(named.problem, "car", MakeMotion(testing::Driven(0.2), "driven"),
                     {{"position", 0.0, 1.0}});
  named.problem.motions[0].input = {"inverse_scale", 0.5};
  testing::AddSensor(named.problem, "disparity", testing::LinearSensor(1.0, 1.0), {"car.position"});
  named.estimator =
      std::make_unique<Ekf>(named.problem, EkfOptions{}, experiment.source->streams());
  const RunResult run = alidade::Run(experiment, {});
  const EstimatorResult& ekf = run.estimators[0];
  EXPECT_EQ(std::ranges::count(ekf.events, EventKind::kInputStale, &Event::kind), 1);
  EXPECT_EQ(ekf.counts.at("input_stale"), 99);
  EXPECT_EQ(ekf.counts.at("inputs:car"), 100);
}

TEST(Run, BadDataKeepsWhatWasDone) {
  Experiment experiment = MakeExperiment();
  experiment.source = std::make_unique<Failing>(ExitCode::kBadData);
  const RunResult result = alidade::Run(experiment, {});
  EXPECT_EQ(result.status, RunStatus::kFailed);
  EXPECT_EQ(result.code, ExitCode::kBadData);
  EXPECT_EQ(result.reason, "rows.csv:7 d: 'x' is not a number");
  EXPECT_EQ(result.frames, 5);
  EXPECT_EQ(result.estimators[0].counts.at("accepted:inverse_scale"), 5);
}

/// A source that throws a logic_error after five frames. Such an exception indicates a defect of
/// the program.
class Breaking : public testing::SwingingTarget {
 public:
  Breaking() : SwingingTarget(60) {}
  bool Next(SourceFrame& frame) override {
    if (++count_ > 5) throw std::logic_error("an invariant");
    return SwingingTarget::Next(frame);
  }

 private:
  int count_ = 0;
};

/// A smoother whose landmarks() throws.
struct Mapless : Hindsight {
  using Hindsight::Hindsight;
  std::vector<LandmarkEstimate> landmarks() const override {
    throw std::out_of_range("a missing landmark");
  }
};

TEST(Run, AFailureAtTheEndKeepsTheResults) {
  Experiment experiment = MakeExperiment();
  EstimatorSpec& first = experiment.estimators[0];
  first.problem.landmarks.emplace();
  first.estimator = std::make_unique<Mapless>(first.problem);
  const RunResult result = alidade::Run(experiment, {});
  EXPECT_EQ(result.status, RunStatus::kFailed);
  EXPECT_EQ(result.code, ExitCode::kInternal);
  EXPECT_NE(result.reason.find("a missing landmark"), std::string::npos) << result.reason;
  ASSERT_EQ(result.estimators.size(), 2u);
  EXPECT_FALSE(result.estimators[1].metrics.empty());
}

/// A smoother that fails in Smooth.
struct FailsLate : Hindsight {
  using Hindsight::Hindsight;
  void Smooth(const Emit&) override {
    failed_ = true;
    throw Error(ExitCode::kDiverged, "no optimum");
  }
};

TEST(Run, TheFirstFailureIsTheReason) {
  const auto reason = [](bool explodes) {
    Experiment experiment = MakeExperiment();
    EstimatorSpec& alone = experiment.estimators[1];
    alone.estimator = std::make_unique<FailsLate>(alone.problem);
    if (explodes) {
      experiment.estimators.push_back(ExplodingEstimator(experiment.source->streams()));
    }
    return alidade::Run(experiment, {}).reason;
  };
  EXPECT_TRUE(reason(false).ends_with(": no optimum")) << reason(false);
  EXPECT_TRUE(reason(true).starts_with("estimator 'exploding'")) << reason(true);
}

TEST(Run, ADefectIsAResultToo) {
  Experiment experiment = MakeExperiment();
  experiment.source = std::make_unique<Breaking>();
  const RunResult result = alidade::Run(experiment, {});
  EXPECT_EQ(result.code, ExitCode::kInternal);
  EXPECT_EQ(result.reason, "internal: an invariant");
  EXPECT_EQ(result.estimators[0].counts.at("accepted:inverse_scale"), 5);
}

/// A source that changes its fourth frame with `spoil`.
class Spoiling : public testing::SwingingTarget {
 public:
  explicit Spoiling(void (*spoil)(SourceFrame&)) : SwingingTarget(60), spoil_(spoil) {}
  bool Next(SourceFrame& frame) override {
    const bool more = SwingingTarget::Next(frame);
    if (++count_ == 4) spoil_(frame);
    return more;
  }

 private:
  void (*spoil_)(SourceFrame&);
  int count_ = 0;
};

TEST(Run, AFrameThatBreaksTheContractOfItsSourceEndsTheRun) {
  struct Case {
    void (*spoil)(SourceFrame&);
    std::string reason;
  };
  for (const Case& one : std::vector<Case>{
           {[](SourceFrame& f) { f.measurements[0].values.clear(); },
            "0 values of 'inverse_scale', not 1"},
           {[](SourceFrame& f) {
              f.measurements[0].values = {1, 2};
            },
            "2 values of 'inverse_scale', not 1"},
           {[](SourceFrame& f) { f.measurements[0].stream = -1; },
            "a measurement with stream index -1, although the number of streams is 2"},
           {[](SourceFrame& f) { f.measurements[0].stream = 2; },
            "a measurement with stream index 2, although the number of streams is 2"},
           {[](SourceFrame& f) {
              f.truth[0] = {1, 2};
            },
            "2 values of 'depth', not 1"},
           {[](SourceFrame& f) { f.truth.resize(2); },
            "2 truths, although the number of truths is 1"}}) {
    Experiment experiment = MakeExperiment();
    const SharedSensor stereo = experiment.estimators[0].problem.sensors[1].model;
    experiment.segments.push_back({"near", 1, true, stereo});
    experiment.source = std::make_unique<Spoiling>(one.spoil);
    const RunResult result = alidade::Run(experiment, {});
    EXPECT_EQ(result.code, ExitCode::kInternal);
    EXPECT_NE(result.reason.find("the source returned " + one.reason), std::string::npos)
        << result.reason;
    EXPECT_NE(result.reason.find("at t = 0.099000 s"), std::string::npos) << result.reason;
    EXPECT_EQ(result.frames, 3);
    EXPECT_EQ(result.estimators[0].counts.at("accepted:inverse_scale"), 3);
  }
}

// The size of a covariance can come from a config, so it is an error of the data.
TEST(Run, ACovarianceOfAnotherSizeThanItsMeasurementEndsTheRun) {
  Experiment experiment = MakeExperiment();
  experiment.source = std::make_unique<Spoiling>([](SourceFrame& f) {
    f.measurements[0].covariance = {1, 0, 0, 1};
  });
  const RunResult result = alidade::Run(experiment, {});
  EXPECT_EQ(result.code, ExitCode::kBadData);
  EXPECT_EQ(
      result.reason,
      "inverse_scale: the covariance has 4 numbers, but the measurement has 1 degree of freedom; "
      "expected a covariance of 1 x 1");
  EXPECT_EQ(result.frames, 3);
}

TEST(Run, TheSameSeedGivesTheSameMetricsTwice) {
  Experiment first = MakeExperiment(), second = MakeExperiment();
  EXPECT_EQ(alidade::Run(first, {}).estimators[0].metrics,
            alidade::Run(second, {}).estimators[0].metrics);
}

TEST(Experiment, KeysAndScalarsOfAConfig) {
  const Config config =
      Config::FromText("a: {model: b, list: [c, {d: 1.5}]}\ne: 'f g'", "test.yaml");
  EXPECT_EQ(KeysAndScalarsOf(config),
            (std::set<std::string>{"a", "model", "b", "list", "c", "d", "1.5", "e", "f g"}));
  EXPECT_THROW(config.root().RejectUnread(), Error);  // no key was marked as read
}

}  // namespace
}  // namespace alidade
