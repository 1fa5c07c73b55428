// SPDX-License-Identifier: Apache-2.0
//
// Tests a batch that uses the measurements accepted by a filter, and a batch as the reference.
#include "alidade/experiment/run.h"
#include "batch_fixture.h"
#include "support/recording.h"

namespace alidade {
namespace {

using testing::Shipped;
using testing::SwingingTarget;

bool IsOutlier(int k) { return k % 13 == 6; }

/// A SwingingTarget. In some frames the disparity is off by 40 px. If `outliers` is false, these
/// frames have no disparity.
class WithOutliers : public SwingingTarget {
 public:
  explicit WithOutliers(bool outliers) : SwingingTarget(80), outliers_(outliers) {}
  bool Next(SourceFrame& frame) override {
    if (!SwingingTarget::Next(frame)) return false;
    const int k = next_++;
    if (!IsOutlier(k) || frame.measurements.size() < 2) return true;
    if (outliers_) {
      frame.measurements[1].values[0] += 40.0;
    } else {
      frame.measurements.pop_back();
    }
    return true;
  }

 private:
  bool outliers_;
  int next_ = 0;
};

/// Batch that records its estimates.
struct Told : Estimator {
  explicit Told(const Problem& problem) : batch(testing::MakeBatch(problem)) {}
  void Start(Timestamp timestamp) override { batch->Start(timestamp); }
  const UpdateReport& Process(const Frame& frame) override { return batch->Process(frame); }
  bool offline() const override { return true; }
  void Smooth(const Emit& emit) override {
    batch->Smooth([&](std::size_t k, const State& state, const UpdateReport& report) {
      x.push_back(state.values());
      p.push_back(state.covariance().Dense());
      emit(k, state, report);
    });
  }
  const State& state() const override { return batch->state(); }
  Timestamp timestamp() const override { return batch->timestamp(); }
  bool diverged() const override { return batch->diverged(); }
  bool failed() const override { return batch->failed(); }

  std::unique_ptr<Estimator> batch;
  std::vector<std::vector<double>> x;
  std::vector<Eigen::MatrixXd> p;
};

/// Returns an experiment of an ekf with a gate and a batch. The batch uses all data, or the data
/// that the ekf accepted.
Experiment MakeWithBatch(bool outliers, bool accepted) {
  Experiment experiment;
  experiment.source = std::make_unique<WithOutliers>(outliers);
  const Problem problem = testing::DepthFilter();
  EkfOptions options;
  options.gate = 0.9999;
  auto ekf = std::make_unique<Ekf>(problem, options, testing::StreamsOf(problem));
  experiment.estimators.push_back({"ekf", "ekf", EstimatorKind::kFilter, problem, std::move(ekf),
                                   OnDivergence::kReport, OnPluginFailure::kSkip, false, ""});
  experiment.estimators.push_back({"batch", "ceres_batch", EstimatorKind::kBatch, problem,
                                   std::make_unique<Told>(problem), OnDivergence::kReport,
                                   OnPluginFailure::kSkip, false, ""});
  if (accepted) experiment.estimators[1].accepted_by = 0;
  return experiment;
}

const Told& BatchOf(const Experiment& experiment) {
  return dynamic_cast<const Told&>(*experiment.estimators[1].estimator);
}

TEST(CeresBatchUse, OfWhatAFilterAcceptedIsTheBatchWithoutTheOutliers) {
  Experiment filtered = MakeWithBatch(true, true), clean = MakeWithBatch(false, false),
             spoiled = MakeWithBatch(true, false);
  const RunResult run = alidade::Run(filtered, {});
  ASSERT_EQ(run.status, RunStatus::kOk) << run.reason;
  // Three of the frames with outliers contain a disparity: frames 6, 32 and 58.
  EXPECT_EQ(run.estimators[0].counts.at("gated:disparity"), 3);
  EXPECT_EQ(run.estimators[0].counts.count("gated:inverse_scale"), 0u);
  ASSERT_EQ(alidade::Run(clean, {}).status, RunStatus::kOk);
  ASSERT_EQ(alidade::Run(spoiled, {}).status, RunStatus::kOk);
  const Told &found = BatchOf(filtered), &expected = BatchOf(clean), &other = BatchOf(spoiled);
  ASSERT_EQ(found.x.size(), 80u);
  double spoilt = 0.0;
  for (std::size_t k = 0; k < 80; ++k) {
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(found.x[k][i], expected.x[k][i], 1e-9) << k;
      spoilt = std::max(spoilt, std::abs(found.x[k][i] - other.x[k][i]));
    }
    EXPECT_LT((found.p[k] - expected.p[k]).cwiseAbs().maxCoeff(), 1e-9) << k;
  }
  EXPECT_GT(spoilt, 0.01);
}

// ---- configs ------------------------------------------------------------------------------------

RunResult RunDepth(const std::vector<std::pair<std::string, std::string>>& settings) {
  Config config = Config::FromFile(ALIDADE_SOURCE_DIR "/examples/05_depth_principled/config.yaml");
  for (const auto& [key, value] : settings) config.Set(key, value, "--set");
  Experiment experiment = BuildExperiment(config, Shipped());
  return Run(experiment, {});
}

TEST(CeresBatchUse, IsReadFromTheConfig) {
  // The gate is narrow. The batch must use exactly the measurements that passed the gate.
  const RunResult run = RunDepth({{"estimators.ekf.gate", "0.5"},
                                  {"estimators.batch", "{type: ceres_batch}"},
                                  {"estimators.batch.use.accepted_by", "ekf"}});
  ASSERT_EQ(run.estimators.size(), 2u);
  EXPECT_GT(run.estimators[0].counts.at("gated:scale"), 10);
  EXPECT_EQ(run.estimators[1].counts.at("accepted:scale"),
            run.estimators[0].counts.at("accepted:scale"));
}

TEST(CeresBatchUse, AsTheReferenceGivesErrorsWithoutTruth) {
  const RunResult run =
      RunDepth({{"estimators.batch", "{type: ceres_batch}"}, {"reference", "batch"}});
  ASSERT_EQ(run.status, RunStatus::kOk) << run.reason;
  EXPECT_EQ(run.reference, "batch");
  EXPECT_EQ(run.estimators[1].metrics.count("rmse:target.depth"), 0u);
  // The RMSE relative to the truth is 1.95 mm for the filter and 1 mm for the batch. The RMSE of
  // the filter relative to the batch lies in between.
  const double rmse = run.estimators[0].metrics.at("rmse:target.depth");
  EXPECT_GT(rmse, 0.8e-3);
  EXPECT_LT(rmse, 2.5e-3);
}

TEST(CeresBatchUse, ABatchThatDoesNotConvergeIsNoReference) {
  const RunResult run = RunDepth({{"estimators.batch", "{type: ceres_batch}"},
                                  {"estimators.batch.max_iterations", "1"},
                                  {"reference", "batch"}});
  EXPECT_EQ(run.code, ExitCode::kDiverged);
  EXPECT_EQ(run.withheld,
            "no reference is available: estimator 'batch' failed, so the comparison with this "
            "estimator is withheld");
  EXPECT_EQ(run.estimators[0].metrics.count("rmse:target.depth"), 0u);
}

}  // namespace
}  // namespace alidade
