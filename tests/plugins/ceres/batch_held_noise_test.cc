// SPDX-License-Identifier: Apache-2.0
//
// Tests the batch and the fixed-lag smoother over gaps that are split into steps. Held noise is a
// single input for each gap.
#include <cmath>

#include "alidade/estimation/rts.h"
#include "alidade/experiment/estimator_plugin.h"
#include "batch_fixture.h"

namespace alidade {
namespace {

using testing::FrameAt;

struct Estimate {
  std::vector<double> x;
  Eigen::MatrixXd p;
};

/// Returns the estimates of all frames for which `wanted` is true.
template <class Wanted>
std::vector<Estimate> EstimatesOf(Estimator& estimator, const std::vector<Frame>& frames,
                                  const Wanted& wanted) {
  std::vector<Estimate> result;
  const auto take = [&](std::size_t k, const State& state) {
    if (wanted(frames[k])) result.push_back({state.values(), state.covariance().Dense()});
  };
  for (std::size_t k = 0; k < frames.size(); ++k) {
    estimator.Process(frames[k]);
    if (!estimator.offline()) take(k, estimator.state());
  }
  if (estimator.offline()) {
    estimator.Smooth(
        [&](std::size_t k, const State& state, const UpdateReport&) { take(k, state); });
  }
  EXPECT_FALSE(estimator.failed());
  return result;
}

bool All(const Frame&) { return true; }
bool Measured(const Frame& frame) { return !frame.measurements.empty(); }

void ExpectNear(const std::vector<Estimate>& found, const std::vector<Estimate>& expected,
                double tolerance) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t k = 0; k < found.size(); ++k) {
    for (std::size_t i = 0; i < found[k].x.size(); ++i) {
      EXPECT_NEAR(found[k].x[i], expected[k].x[i], tolerance) << k << ' ' << i;
    }
    EXPECT_LT((found[k].p - expected[k].p).cwiseAbs().maxCoeff(), tolerance) << k;
  }
}

Problem HeldSystem() {
  Problem problem = testing::HeldPoint(0.7);
  testing::AddSensor(problem, "z", testing::LinearSensor(2.0, 0.3), {"p.x"});
  return problem;
}

/// Returns frames with 10 measurements per second. `parts` - 1 frames without a measurement precede
/// each measurement.
std::vector<Frame> Frames(int count, int parts) {
  std::vector<Frame> frames;
  for (int k = 0; k <= (count - 1) * parts; ++k) {
    const double t_s = 0.1 * k / parts;
    frames.push_back(FrameAt(t_s, {}));
    if (k % parts != 0) continue;
    const double z = 2.0 * std::cos(t_s) + 0.3 * std::sin(37.0 * (k / parts));
    frames.back().measurements.push_back({frames.back().timestamp, 0, -1, {z}, {}});
  }
  return frames;
}

std::unique_ptr<Estimator> Make(const char* type, const std::string& options) {
  const Problem problem = HeldSystem();
  const Config config = Config::FromText(std::string("type: ") + type + "\n" + options, "e.yaml");
  return CreateEstimator(testing::Shipped(), type, config.root())(problem,
                                                                  testing::StreamsOf(problem));
}

struct Case {
  const char* type;
  const char* options;
};
constexpr Case kCases[] = {{"ceres_batch", ""},
                           {"ceres_batch", "mode: filtering\n"},
                           {"fixed_lag", "lag_s: 0.25\n"},
                           {"fixed_lag", "lag_s: 0.25\noutput: lagged\n"}};

TEST(CeresBatchHeldNoise, AGapIsAGapHoweverItIsSplit) {
  for (const Case& c : kCases) {
    SCOPED_TRACE(std::string(c.type) + ' ' + c.options);
    const auto whole = EstimatesOf(*Make(c.type, c.options), Frames(25, 1), All);
    const std::string parts = std::string(c.options) + "max_dt_s: 0.021\n";
    ExpectNear(EstimatesOf(*Make(c.type, parts), Frames(25, 1), All), whole, 1e-9);
    // Further frames without a measurement do not change the time that the data of a window span.
    ExpectNear(EstimatesOf(*Make(c.type, c.options), Frames(25, 4), Measured), whole, 1e-9);
  }
}

// The comparison includes the frames inside a gap, over which the noise is held.
TEST(CeresBatchHeldNoise, IsTheSmootherAtEveryFrame) {
  const Problem problem = HeldSystem();
  const std::vector<Frame> frames = Frames(12, 3);
  RtsSmoother rts(problem, {.max_dt_s = 0.02}, testing::StreamsOf(problem));
  ExpectNear(EstimatesOf(*Make("ceres_batch", "max_dt_s: 0.02\n"), frames, All),
             EstimatesOf(rts, frames, All), 1e-9);
}

// The newest estimate of the window equals that of the filter. At most frames the start of the
// window lies inside a gap.
TEST(CeresBatchHeldNoise, ALinearWindowIsTheFilterAtEveryFrame) {
  const Problem problem = HeldSystem();
  const std::vector<Frame> frames = Frames(20, 4);
  for (const char* window : {"0.01", "0.06", "0.13", "0.5"}) {
    Ekf ekf(problem, {}, testing::StreamsOf(problem));
    const auto lag = Make("fixed_lag", std::string("lag_s: ") + window + "\n");
    ExpectNear(EstimatesOf(*lag, frames, All), EstimatesOf(ekf, frames, All), 1e-9);
  }
}

// 1000 gaps are split into 10 parts each. The batch has 2 inputs for the prior and 1 input for each
// gap, fewer than the limit of 4000.
TEST(CeresBatchHeldNoise, HasOneInputForEachGap) {
  const auto batch = Make("ceres_batch", "max_dt_s: 0.011\n");
  const std::vector<Frame> frames = Frames(1001, 2);
  for (const Frame& frame : frames) batch->Process(frame);
  EXPECT_FALSE(batch->failed());
}

}  // namespace
}  // namespace alidade
