// SPDX-License-Identifier: Apache-2.0
//
// Tests discrete process noise, which is constant between two updates. Splitting the time between
// the updates must not change the result.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <functional>
#include <memory>

#include "alidade/base/random.h"
#include "alidade/estimation/iekf.h"
#include "alidade/estimation/rts.h"
#include "alidade/estimation/square_root_ekf.h"
#include "alidade/estimation/ukf.h"
#include "support/systems.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

struct Options {
  double max_dt_s = std::numeric_limits<double>::infinity();
  double gate = 1.0;
};

template <class Filter>
std::unique_ptr<Filter> Make(const Problem& problem, const Options& options,
                             const std::vector<StreamInfo>& streams) {
  EkfOptions common;
  common.max_dt_s = options.max_dt_s;
  common.gate = options.gate;
  if constexpr (std::is_same_v<Filter, Iekf>) {
    return std::make_unique<Iekf>(problem, IekfOptions{common}, streams);
  } else if constexpr (std::is_same_v<Filter, Ukf>) {
    return std::make_unique<Ukf>(problem, UkfOptions{common}, streams);
  } else {
    return std::make_unique<Filter>(problem, common, streams);
  }
}

/// Returns the largest difference between the values or the covariances of two states. A difference
/// of covariances is divided by the standard deviations.
double Apart(const State& a, const State& b) {
  double most = 0.0;
  for (std::size_t i = 0; i < a.values().size(); ++i) {
    most = std::max(most, std::abs(a.values()[i] - b.values()[i]));
  }
  const Eigen::MatrixXd p = a.covariance().Dense(), difference = p - b.covariance().Dense();
  const Eigen::VectorXd sigma = p.diagonal().cwiseSqrt();
  for (Eigen::Index i = 0; i < p.rows(); ++i) {
    for (Eigen::Index j = 0; j < p.cols(); ++j) {
      most = std::max(most, std::abs(difference(i, j)) / (sigma[i] * sigma[j]));
    }
  }
  return most;
}

/// Returns 60 frames of the depth filter, 30 per second. Every third frame has no disparity.
std::vector<Frame> DepthFrames() {
  std::vector<Frame> frames;
  Random random(11);
  for (int k = 0; k < 60; ++k) {
    const double t_s = k / 30.0, depth = 0.3 + 0.1 * std::sin(t_s);
    frames.push_back(FrameAt(t_s, {{1, depth / 0.3 + 0.01 * random.Normal()}}));
    if (k % 3 != 0) {
      frames.back().measurements.push_back(
          {frames.back().timestamp, 0, -1, {26.0 / depth + random.Normal()}, {}});
    }
  }
  return frames;
}

/// Inserts `parts` - 1 frames without measurements before each frame except the first.
std::vector<Frame> WithEmptyFrames(const std::vector<Frame>& frames, int parts) {
  std::vector<Frame> all;
  for (const Frame& frame : frames) {
    const Timestamp last = all.empty() ? frame.timestamp : all.back().timestamp;
    for (int i = 1; i < parts && !all.empty(); ++i) {
      all.emplace_back().timestamp = last + (frame.timestamp - last) * i / parts;
    }
    all.push_back(frame);
  }
  return all;
}

/// Returns the states after the frames that have a measurement. A smoother returns its smoothed
/// states.
std::vector<State> StatesOf(Estimator& filter, const std::vector<Frame>& frames) {
  std::vector<State> states;
  for (const Frame& frame : frames) {
    filter.Process(frame);
    if (!filter.offline() && !frame.measurements.empty()) states.push_back(filter.state());
  }
  EXPECT_FALSE(filter.failed());
  if (!filter.offline()) return states;
  filter.Smooth([&](std::size_t k, const State& state, const UpdateReport&) {
    if (!frames[k].measurements.empty()) states.push_back(state);
  });
  return states;
}

double MostApart(const std::vector<State>& a, const std::vector<State>& b) {
  EXPECT_EQ(a.size(), b.size());
  double most = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) most = std::max(most, Apart(a[k], b[k]));
  return most;
}

template <class Filter>
class HeldNoise : public ::testing::Test {
 protected:
  static std::vector<State> Run(const Problem& problem, const std::vector<Frame>& frames,
                                const Options& options = {}) {
    return StatesOf(*Make<Filter>(problem, options, StreamsOf(problem)), frames);
  }
  /// Tolerance for rounding errors. With sigma points, rounding errors grow with eps / alpha^2. In
  /// the smoother they grow with P / P_s, which is up to 1e4 here.
  static constexpr bool kCancels =
      std::is_same_v<Filter, Ukf> || std::is_same_v<Filter, RtsSmoother>;
  static constexpr double kTolerance = kCancels ? 1e-9 : 1e-11;
};

using Filters = ::testing::Types<Ekf, Iekf, SquareRootEkf, Ukf, RtsSmoother>;
TYPED_TEST_SUITE(HeldNoise, Filters);

// The motion is linear, so only rounding errors remain.
TYPED_TEST(HeldNoise, StepsInPartsAreTheStep) {
  const auto whole = this->Run(DepthFilter(), DepthFrames());
  for (const double max_dt_s : {0.02, 0.002}) {
    const auto split = this->Run(DepthFilter(), DepthFrames(), {max_dt_s});
    EXPECT_LT(MostApart(whole, split), this->kTolerance) << max_dt_s;
  }
}

TYPED_TEST(HeldNoise, FramesWithoutMeasurementsChangeNothing) {
  const auto whole = this->Run(DepthFilter(), DepthFrames());
  const std::vector<Frame> more = WithEmptyFrames(DepthFrames(), 10);
  EXPECT_LT(MostApart(whole, this->Run(DepthFilter(), more)), this->kTolerance);
  EXPECT_LT(MostApart(whole, this->Run(DepthFilter(), more, {0.001})), this->kTolerance);
}

// Rejected measurements change no estimate: the result is the same if they are removed from the
// data.
TYPED_TEST(HeldNoise, RejectedMeasurementsAreNone) {
  const Problem problem = DepthFilter();
  std::vector<Frame> frames = DepthFrames(), wild;
  for (const Frame& frame : frames) {
    if (!wild.empty()) {
      wild.push_back(FrameAt(Seconds(frame.timestamp) - 0.01, {{0, 1e5}, {1, 400.0}}));
    }
    wild.push_back(frame);
  }
  const auto filter = Make<TypeParam>(problem, {.gate = 1.0 - 1e-6}, StreamsOf(problem));
  std::vector<State> states;
  const std::vector<State> all = StatesOf(*filter, wild);
  for (std::size_t k = 0; k < all.size(); k += 2) states.push_back(all[k]);
  EXPECT_LT(MostApart(this->Run(problem, frames, {.gate = 1.0 - 1e-6}), states), this->kTolerance);
}

// The problem has two motion models. One has discrete noise, and the noise of the other is
// independent from step to step.
TYPED_TEST(HeldNoise, StandsBesideNoiseThatAddsUp) {
  Problem problem = DepthFilter();
  problem.motions[1].model = testing::ConstantMotion(1, 0.3);
  const auto whole = this->Run(problem, DepthFrames());
  EXPECT_LT(MostApart(whole, this->Run(problem, DepthFrames(), {0.002})), this->kTolerance);
  const std::vector<Frame> more = WithEmptyFrames(DepthFrames(), 4);
  EXPECT_LT(MostApart(whole, this->Run(problem, more)), this->kTolerance);
}

TYPED_TEST(HeldNoise, ContinuousNoiseAddsUp) {
  Problem problem = DepthFilter();
  problem.motions[0].model = MakeMotion(ConstantVelocity<1, true>(1.0), "constant_velocity");
  const auto whole = this->Run(problem, DepthFrames());
  EXPECT_LT(MostApart(whole, this->Run(problem, DepthFrames(), {0.002})), this->kTolerance);
  const std::vector<Frame> more = WithEmptyFrames(DepthFrames(), 4);
  EXPECT_LT(MostApart(whole, this->Run(problem, more)), this->kTolerance);
}

/// Constant-velocity motion model with a control input that has no effect.
struct Pushed : Motion<1, Vec<1>, Vec<1>> {
  static constexpr std::array kBlocks{Quantity{"depth", "m"}, Quantity{"depth_rate", "m/s"}};
  using Input = Vec<1>;
  static constexpr Quantity kInput{"push", "m/s^2"};
  NoiseKind noise_kind() const { return NoiseKind::kDiscrete; }
  template <class T>
  void Step(const T* p, const T* v, const T* u, const T* w, double dt_s, T* p1, T* v1) const {
    const T a = w[0] + 0.0 * u[0];
    p1[0] = p[0] + dt_s * v[0] + 0.5 * dt_s * dt_s * a;
    v1[0] = v[0] + dt_s * a;
  }
  void SqrtQ(double, MatrixRef l) const { l(0, 0) = 1.0; }
};

TYPED_TEST(HeldNoise, ControlInputsThatChangeInsideAGapDoNotSplitIt) {
  const auto whole = this->Run(DepthFilter(), DepthFrames());
  Problem problem = DepthFilter();
  problem.motions[0].model = MakeMotion(Pushed(), "pushed");
  problem.motions[0].input = {"push", 0.004};  // the input times out after 4 ms
  std::vector<StreamInfo> streams = StreamsOf(problem);
  streams.push_back({"push", 1});
  std::vector<Frame> frames;
  for (const Frame& frame : DepthFrames()) {
    if (!frames.empty()) frames.push_back(FrameAt(Seconds(frame.timestamp) - 0.011, {{2, 3.0}}));
    frames.push_back(frame);
  }
  const auto all = StatesOf(*Make<TypeParam>(problem, {}, streams), frames);
  std::vector<State> states;
  for (std::size_t k = 0; k < all.size(); k += 2) states.push_back(all[k]);
  EXPECT_LT(MostApart(whole, states), this->kTolerance);
}

// The first block is constant, so it has no error and no rows in M.
TYPED_TEST(HeldNoise, OfAKnownBlockThereIsNone) {
  const auto problem = [](BlockStatus position) {
    Problem made;
    MotionBinding binding{"p", testing::ConstantVelocityMotion(2.0), {}};
    binding.blocks = {
        made.layout.Declare("p.x", "p", binding.model->blocks()[0], position),
        made.layout.Declare("p.v", "p", binding.model->blocks()[1], BlockStatus::kEstimated)};
    Prior x{binding.blocks[0], {1.0}, {}, {}}, v{binding.blocks[1], {0.5}, {}, {}};
    if (position != BlockStatus::kConstant) x.covariance = Eigen::MatrixXd::Constant(1, 1, 0.1);
    v.covariance = Eigen::MatrixXd::Constant(1, 1, 0.25);
    made.priors = {x, v};
    made.motions.push_back(binding);
    AddSensor(made, "rate", LinearSensor(1.0, 0.2), {"p.v"});
    return made;
  };
  std::vector<Frame> frames;
  for (int k = 0; k < 20; ++k) frames.push_back(FrameAt(0.1 * k, {{0, std::sin(0.7 * k)}}));
  for (const BlockStatus status : {BlockStatus::kConstant, BlockStatus::kEstimated}) {
    const auto whole = this->Run(problem(status), frames);
    EXPECT_LT(MostApart(whole, this->Run(problem(status), frames, {0.03})), this->kTolerance);
  }
}

template <class Filter>
class HeldNoiseSnapshot : public ::testing::Test {};
using Recursive = ::testing::Types<Ekf, Iekf, SquareRootEkf, Ukf>;
TYPED_TEST_SUITE(HeldNoiseSnapshot, Recursive);

// The copy is made inside a gap: after one part, and after several parts.
TYPED_TEST(HeldNoiseSnapshot, GoesOnFromInsideAGap) {
  const Problem problem = DepthFilter();
  for (const int parts : {1, 3}) {
    const auto filter = Make<TypeParam>(problem, {}, StreamsOf(problem));
    filter->Process(FrameAt(0.0, {{0, 80.0}, {1, 1.0}}));
    for (int i = 1; i <= parts; ++i) filter->Process(FrameAt(0.01 * i, {}));
    const TypeParam saved = *filter;
    const Frame next = FrameAt(0.1, {{0, 75.0}, {1, 1.1}});
    filter->Process(next);
    const State once = filter->state();
    filter->Process(FrameAt(0.3, {}));
    filter->Process(FrameAt(0.4, {{0, 70.0}}));
    *filter = saved;
    filter->Process(next);
    EXPECT_EQ(filter->state().values(), once.values()) << parts;
    EXPECT_EQ(filter->state().covariance().Dense(), once.covariance().Dense()) << parts;
  }
}

// The frames of one second have no measurements and form a single interval. So Var(v) grows by
// sigma^2 T^2.
TYPED_TEST(HeldNoiseSnapshot, IsHeldOverTheWholeGap) {
  const Problem problem = HeldPoint(1.0);
  const auto filter = Make<TypeParam>(problem, {}, {});
  for (int k = 0; k <= 10; ++k) filter->Process(FrameAt(0.1 * k, {}));
  EXPECT_NEAR(CovarianceOf(filter->state(), "p.v", "p.v"), 9.0 + 1.0, 1e-9);
  EXPECT_NEAR(CovarianceOf(filter->state(), "p.x", "p.x"), 4.0 + 9.0 + 0.25, 1e-9);
}

// The initialisation of a block ends the noise interval. An update without information also ends
// the noise interval.
TEST(HeldNoiseOfAFirstValue, IsHeldAnewAfterIt) {
  Problem waits = DepthFilter();
  waits.priors[2] = {2, {}, {}, "inverse_scale"};
  const Problem problem = DepthFilter();
  Ekf starts(waits, {}, StreamsOf(waits)), corrected(problem, {}, StreamsOf(problem));
  Ekf goes_on = corrected;
  for (Ekf* one : {&starts, &corrected, &goes_on}) one->Start(0);
  Frame vague = FrameAt(0.2, {{0, 74.0}});
  vague.measurements[0].covariance = {1e30};
  for (int k = 1; k <= 3; ++k) {
    const Frame empty = FrameAt(0.1 * k, {});
    starts.Process(k == 2 ? FrameAt(0.2, {{1, 1.0}}) : empty);
    corrected.Process(k == 2 ? vague : empty);
    goes_on.Process(empty);
  }
  const auto covariance = [](const Ekf& ekf) {
    return CovarianceOf(ekf.state(), "target.depth", "target.depth_rate");
  };
  EXPECT_NEAR(covariance(starts), covariance(corrected), 1e-12);
  EXPECT_GT(std::abs(covariance(starts) - covariance(goes_on)), 1e-3);
}

// The expected values are the least-squares solution of x_k = Phi_k x_0 + sum Gamma w. There is one
// w for each interval between measured frames.
TEST(HeldNoiseSmoother, EqualsTheBatchAtFramesInsideAGap) {
  constexpr int kFrames = 40;
  constexpr double kDt = 0.05, kSigma = 0.7;
  Problem problem = HeldPoint(kSigma);
  AddSensor(problem, "z", LinearSensor(2.0, 0.3), {"p.x"});
  RtsSmoother rts(problem, {}, StreamsOf(problem)),
      parts(problem, {.max_dt_s = 0.02}, StreamsOf(problem));
  Eigen::MatrixXd normal = Eigen::MatrixXd::Identity(2 + kFrames, 2 + kFrames);
  normal.topLeftCorner<2, 2>() = Eigen::Vector2d(1.0 / 4.0, 1.0 / 9.0).asDiagonal();
  Eigen::VectorXd right = Eigen::VectorXd::Zero(2 + kFrames);
  right.head<2>() = Eigen::Vector2d(1.0 / 4.0, -0.5 / 9.0);
  std::vector<Eigen::MatrixXd> map{Eigen::MatrixXd::Identity(2, 2 + kFrames)};
  Random random(5);
  int noise = 0;
  for (int k = 0; k < kFrames; ++k) {
    Frame frame = FrameAt(kDt * k, {});
    if (k > 0) {
      const Eigen::Matrix2d f{{1.0, kDt}, {0.0, 1.0}};
      map.emplace_back(f * map.back());
      map.back().col(2 + noise) += kSigma * Eigen::Vector2d(0.5 * kDt * kDt, kDt);
    }
    if (k % 5 == 0 || k % 7 == 3) {
      const double z = random.Normal();
      frame.measurements.push_back({frame.timestamp, 0, -1, {z}, {}});
      const Eigen::RowVectorXd row = 2.0 * map.back().row(0) / 0.3;
      normal += row.transpose() * row;
      right += row.transpose() * z / 0.3;
      ++noise;
    }
    rts.Process(frame);
    parts.Process(frame);
  }
  const Eigen::MatrixXd covariance = normal.inverse();
  for (RtsSmoother* const one : {&rts, &parts}) {
    one->Smooth([&](std::size_t k, const State& state, const UpdateReport&) {
      const Eigen::Vector2d x = map[k] * covariance * right;
      const Eigen::Matrix2d p = map[k] * covariance * map[k].transpose();
      EXPECT_NEAR(ValueOf(state, "p.x"), x[0], 1e-9) << k;
      EXPECT_NEAR(ValueOf(state, "p.v"), x[1], 1e-9) << k;
      EXPECT_LT((state.covariance().Dense() - p).norm(), 1e-9) << k;
    });
  }
}

}  // namespace
}  // namespace alidade
