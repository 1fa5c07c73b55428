// SPDX-License-Identifier: Apache-2.0
#include "alidade/robust_loss.h"

#include <gtest/gtest.h>

#include "alidade/iekf.h"
#include "alidade/rts.h"
#include "alidade/square_root_ekf.h"
#include "alidade/ukf.h"
#include "support/systems.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

constexpr RobustLoss kHuber{LossKind::kHuber, 1.345}, kCauchy{LossKind::kCauchy, 2.0};

TEST(RobustLoss, TheWeightIsTheSlopeOfRhoOverD) {
  constexpr double kStep = 1e-6;
  for (const RobustLoss& loss : {RobustLoss{}, kHuber, kCauchy}) {
    for (const double d : {0.1, 1.0, 1.3, 1.4, 2.0, 7.0, 100.0}) {
      const double slope = (Rho(loss, d + kStep) - Rho(loss, d - kStep)) / (2.0 * kStep);
      EXPECT_NEAR(Weight(loss, d), slope / d, 1e-8) << ToString(loss.kind) << ' ' << d;
    }
    EXPECT_EQ(Weight(loss, 0.0), 1.0);
    EXPECT_EQ(Rho(loss, 0.0), 0.0);
  }
}

TEST(RobustLoss, HasTheTextbookValues) {
  // Huber: k d - k^2 / 2; Cauchy: k^2 / 2 log(1 + d^2 / k^2).
  EXPECT_NEAR(Rho(kHuber, 3.0), 1.345 * 3.0 - 0.5 * 1.345 * 1.345, 1e-15);
  EXPECT_NEAR(Rho(kCauchy, 4.0), 2.0 * std::log(5.0), 1e-15);
  EXPECT_NEAR(Weight(kHuber, 2.69), 0.5, 1e-15);
  EXPECT_NEAR(Weight(kCauchy, 2.0), 0.5, 1e-15);
  EXPECT_EQ(Weight(kHuber, 1.345), 1.0);
}

/// x ~ N(0, 4), measured with R = 1 under the loss.
System Measured(const RobustLoss& loss) {
  System system;
  AddMotion(system, "p", InProcessMotion(Constant<>(1), "constant"), {{"x", 0.0, 2.0}});
  AddSensor(system, "direct", InProcessSensor(Linear(1.0, 1.0), "linear"), {"p.x"});
  system.sensors[0].loss = loss;
  return system;
}

/// One measurement z of it.
template <class Filter>
UpdateReport Measure(const RobustLoss& loss, double z, State& state) {
  const System system = Measured(loss);
  Filter filter(system, {}, StreamsOf(system));
  const UpdateReport report = filter.Process(FrameAt(0.0, {{0, z}}));
  state = filter.state();
  return report;
}

template <class Filter>
class RobustFilter : public ::testing::Test {};
using Filters = ::testing::Types<Ekf, Iekf, SquareRootEkf, Ukf, RtsSmoother>;
TYPED_TEST_SUITE(RobustFilter, Filters);

TYPED_TEST(RobustFilter, TakesAnOutlierWithROverW) {
  // S = 5, d = 10 / sqrt(5).
  constexpr double kOutlier = 10.0;
  const double d = kOutlier / std::sqrt(5.0);
  for (const auto& [loss, w] :
       {std::pair{kHuber, 1.345 / d}, {kCauchy, 1.0 / (1.0 + d * d / 4.0)}}) {
    State state;
    const UpdateReport report = Measure<TypeParam>(loss, kOutlier, state);
    const double gain = 4.0 / (4.0 + 1.0 / w);
    EXPECT_NEAR(ValueOf(state, "p.x"), gain * kOutlier, 1e-12);
    EXPECT_NEAR(CovarianceOf(state, "p.x", "p.x"), 4.0 * (1.0 - gain), 1e-12);
    EXPECT_NEAR(report.measurements()[0].nis, d * d, 1e-12);
    EXPECT_NEAR(report.measurements()[0].s[0], 4.0 + 1.0 / w, 1e-12);
  }
}

TEST(RobustLoss, HuberLeavesAnInlierAsItIs) {
  State robust, plain;
  Measure<Ekf>(kHuber, 2.0, robust);
  Measure<Ekf>({}, 2.0, plain);
  EXPECT_EQ(robust.values(), plain.values());
  EXPECT_EQ(robust.covariance().Dense(), plain.covariance().Dense());
}

// x does not move: every smoothed estimate is that of all measurements, 1 / P = 1/4 + w + 1.
TEST(RobustLoss, TheSmootherGoesBackWithROverW) {
  const System system = Measured(kHuber);
  RtsSmoother rts(system, {}, StreamsOf(system));
  const double w = 1.345 / (10.0 / std::sqrt(5.0)), first = w * 10.0 / (0.25 + w);
  const double second = first + 0.1;  // an inlier
  rts.Process(FrameAt(0.0, {{0, 10.0}}));
  rts.Process(FrameAt(0.1, {{0, second}}));
  int count = 0;
  rts.Smooth([&](std::size_t, const State& state, const UpdateReport&) {
    ++count;
    const double information = 0.25 + w + 1.0;
    EXPECT_NEAR(ValueOf(state, "p.x"), (w * 10.0 + second) / information, 1e-12);
    EXPECT_NEAR(CovarianceOf(state, "p.x", "p.x"), 1.0 / information, 1e-12);
  });
  EXPECT_EQ(count, 2);
}

}  // namespace
}  // namespace alidade
