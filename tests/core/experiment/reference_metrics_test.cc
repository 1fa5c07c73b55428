// SPDX-License-Identifier: Apache-2.0
//
// Tests metrics relative to a reference estimator. The reference replaces the truth.
#include <malloc.h>

#include <cmath>

#include "support/recording.h"
#include "support/sanitized.h"
#include "support/systems.h"

namespace alidade::testing {
namespace {

/// A smoother that estimates a depth of 0.3 m at all frames except the first. If `fails` is true,
/// the smoother fails instead.
struct Known : Estimator {
  Known(const Problem& problem, bool fails) : state_(problem.InitialState()), failed_(fails) {}
  void Start(Timestamp) override {}
  const UpdateReport& Process(const Frame&) override {
    ++frames_;
    return report_;
  }
  bool offline() const override { return true; }
  void Smooth(const Emit& emit) override {
    for (std::size_t k = 0; k < frames_; ++k) {
      state_.values()[0] = k == 0 ? std::nan("") : 0.3;
      emit(k, state_, report_);
    }
  }
  const State& state() const override { return state_; }
  Timestamp timestamp() const override { return kNoTimestamp; }
  bool diverged() const override { return false; }
  bool failed() const override { return failed_; }

 private:
  State state_;
  UpdateReport report_;
  std::size_t frames_ = 0;
  bool failed_;
};

/// A source without truth.
class Blind : public SwingingTarget {
 public:
  using SwingingTarget::SwingingTarget;
  const std::vector<StreamInfo>& truths() const override { return none_; }
  bool Next(SourceFrame& frame) override {
    const bool more = SwingingTarget::Next(frame);
    frame.truth.clear();
    return more;
  }

 private:
  std::vector<StreamInfo> none_;
};

Experiment MakeCompared(bool fails = false) {
  Experiment experiment = MakeExperiment();
  experiment.source = std::make_unique<Blind>(60);
  EstimatorSpec named;
  named.name = "known";
  named.problem = DepthFilter();
  named.estimator = std::make_unique<Known>(named.problem, fails);
  experiment.estimators.push_back(std::move(named));
  experiment.reference = 2;
  return experiment;
}

/// Returns the depth that an ekf estimates at each frame. If `alone` is true, this ekf is the
/// second estimator, otherwise the first.
std::vector<double> Depths(bool alone) {
  Experiment experiment = MakeExperiment();
  Estimator& ekf = *experiment.estimators[alone ? 1 : 0].estimator;
  SourceFrame frame;
  std::vector<double> depths;
  while (experiment.source->Next(frame)) {
    ekf.Process(frame);
    depths.push_back(ValueOf(ekf.state(), "target.depth"));
  }
  return depths;
}

TEST(Reference, ErrorsAreDifferencesFromTheEstimatesOfTheNamedOne) {
  Experiment experiment = MakeCompared();
  const RunResult run = alidade::Run(experiment, {});
  ASSERT_EQ(run.status, RunStatus::kOk) << run.reason;
  EXPECT_EQ(run.reference, "known");
  EXPECT_EQ(run.withheld, "");
  double squares = 0.0;
  const std::vector<double> depths = Depths(false);
  for (std::size_t k = 1; k < depths.size(); ++k) squares += std::pow(depths[k] - 0.3, 2);
  const std::map<std::string, double>& metrics = run.estimators[0].metrics;
  EXPECT_NEAR(metrics.at("rmse:target.depth"), std::sqrt(squares / 59.0), 1e-12);
  EXPECT_NEAR(metrics.at("final_error:target.depth"), std::abs(depths.back() - 0.3), 1e-12);
  EXPECT_EQ(run.estimators[0].units.at("target.depth"), "m");
}

TEST(Reference, MayBeAnyEstimatorOfTheRun) {
  Experiment experiment = MakeCompared();
  experiment.reference = 1;
  const RunResult run = alidade::Run(experiment, {});
  const std::vector<double> ekf = Depths(false), alone = Depths(true);
  double squares = 0.0;
  for (std::size_t k = 0; k < ekf.size(); ++k) squares += std::pow(ekf[k] - alone[k], 2);
  EXPECT_NEAR(run.estimators[0].metrics.at("rmse:target.depth"), std::sqrt(squares / 60.0), 1e-12);
  EXPECT_NEAR(run.estimators[2].metrics.at("final_error:target.depth"),
              std::abs(0.3 - alone.back()), 1e-12);
}

// The covariance of an estimator describes its error relative to truth, not its distance from
// another estimator. NIS depends neither on the truth nor on another estimator.
TEST(Reference, WithholdsWhatTheCovarianceDoesNotTell) {
  Experiment experiment = MakeCompared();
  const RunResult run = alidade::Run(experiment, {});
  for (const EstimatorResult& one : run.estimators) {
    EXPECT_EQ(one.metrics.count("coverage95:target.depth"), 0u);
    EXPECT_EQ(one.metrics.count("nees.mean:target"), 0u);
    // No estimator diverged, although the ekf is a hundred sigma from the reference.
    EXPECT_FALSE(one.diverged);
  }
  EXPECT_EQ(run.estimators[0].metrics.count("nis.mean:disparity"), 1u);
  EXPECT_EQ(run.estimators[2].metrics.size(), 0u);  // the reference is not compared with itself
  EXPECT_EQ(run.estimators[0].counts.at("accepted:inverse_scale"), 60);
}

// Tests fault 85 of tests/faults/README.md.
TEST(Reference, ThatFailedIsNone) {
  Experiment experiment = MakeCompared(true);
  const RunResult run = alidade::Run(experiment, {});
  EXPECT_EQ(run.status, RunStatus::kFailed);
  EXPECT_EQ(run.withheld,
            "no reference is available: estimator 'known' failed, so the comparison with this "
            "estimator is withheld");
  EXPECT_EQ(run.estimators[0].metrics.count("rmse:target.depth"), 0u);
  EXPECT_EQ(run.estimators[0].metrics.count("nis.mean:disparity"), 1u);
  EXPECT_NE(ComparisonTable(run).find("\nno reference is available: estimator 'known' failed"),
            std::string::npos);
}

/// A source that measures by how many bytes the heap grows from the first frame to the last.
class Counting : public Blind {
 public:
  Counting(int frames, std::size_t& grown) : Blind(frames), grown_(grown) {}
  bool Next(SourceFrame& frame) override {
    if (start_ == 0) start_ = InUse();
    const bool more = Blind::Next(frame);
    if (!more) grown_ = InUse() - start_;
    return more;
  }

 private:
  static std::size_t InUse() {
    const struct mallinfo2 info = ::mallinfo2();
    return info.uordblks + info.hblkhd;
  }
  std::size_t start_ = 0;
  std::size_t& grown_;
};

// The P of a state with 302 elements takes 0.7 MB. The covariances of 100 frames of two estimators
// would take 146 MB, and their values 0.5 MB.
TEST(Reference, KeepsNoCovariances) {
  if (kSanitized) GTEST_SKIP() << "the sanitizer does not return freed memory to the heap";
  std::size_t grown = 0;
  Experiment experiment;
  experiment.source = std::make_unique<Counting>(100, grown);
  for (const char* name : {"one", "two"}) {
    EstimatorSpec& named = experiment.estimators.emplace_back();
    named.name = name;
    named.problem = DepthFilter();
    named.problem.sensors.pop_back();
    const SharedMotion model = testing::ConstantMotion(299);
    const BlockId id = named.problem.layout.Declare("wide.x", "wide", model->blocks()[0]);
    named.problem.motions.push_back({"wide", model, {id}});
    named.problem.priors.push_back(
        {id, std::vector<double>(299, 0.0), Eigen::MatrixXd::Identity(299, 299), ""});
    named.estimator =
        std::make_unique<Ekf>(named.problem, EkfOptions{}, experiment.source->streams());
  }
  experiment.reference = 0;
  const RunResult run = alidade::Run(experiment, {});
  ASSERT_EQ(run.status, RunStatus::kOk) << run.reason;
  EXPECT_EQ(run.estimators[1].metrics.at("rmse:wide.x"), 0.0);
  EXPECT_LT(grown, std::size_t{10} << 20);
}

/// A source that throws after `left_` frames, so the smoother does not run.
class Torn : public Blind {
 public:
  using Blind::Blind;
  bool Next(SourceFrame& frame) override {
    if (left_-- == 0) throw Error(ExitCode::kBadData, "torn");
    return Blind::Next(frame);
  }

 private:
  int left_ = 20;
};

TEST(Reference, WithoutEstimatesIsNone) {
  Experiment experiment = MakeCompared();
  experiment.source = std::make_unique<Torn>(60);
  const RunResult run = alidade::Run(experiment, {});
  EXPECT_EQ(run.code, ExitCode::kBadData);
  EXPECT_EQ(run.withheld,
            "no reference is available: estimator 'known' has no estimates, so the comparison with "
            "this estimator is withheld");
  // An online filter has estimates up to the error.
  Experiment online = MakeCompared();
  online.source = std::make_unique<Torn>(60);
  online.reference = 1;
  const RunResult other = alidade::Run(online, {});
  EXPECT_EQ(other.withheld, "");
  EXPECT_EQ(other.estimators[0].metrics.count("rmse:target.depth"), 1u);
}

TEST(Reference, IsNamedBelowTheTableInRunJsonAndInTheReport) {
  const TemporaryFolder folder;
  Experiment experiment = MakeCompared();
  Recorder recorder(OptionsFor(folder / "out"), MakeConfig());
  const RunResult run = RunInto(recorder, experiment);
  recorder.Finish(run);
  const std::string words =
      "errors are differences from estimator 'known', not from truth; coverage and NEES are not "
      "computed";
  EXPECT_TRUE(ComparisonTable(run).ends_with('\n' + words + '\n')) << ComparisonTable(run);
  EXPECT_NE(Read(folder / "out/run.json").find("\"reference\": \"known\""), std::string::npos);
  EXPECT_NE(Read(folder / "out/report.html").find("\"reference\":\"known\""), std::string::npos);

  Experiment plain = MakeExperiment();
  const RunResult truth = alidade::Run(plain, {});
  EXPECT_EQ(truth.reference, "truth");
  EXPECT_EQ(ComparisonTable(truth).find("errors are"), std::string::npos);
}

}  // namespace
}  // namespace alidade::testing
