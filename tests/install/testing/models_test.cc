// SPDX-License-Identifier: Apache-2.0
//
// Tests models and a filter in the same way as the program of a user.
#include <alidade/estimation.h>
#include <alidade/motion_models/constant_velocity.h>
#include <alidade/sensors/stereo_disparity.h>
#include <alidade/testing/frames.h>
#include <alidade/testing/jacobians.h>
#include <alidade/testing/manifold_invariants.h>
#include <gtest/gtest.h>

namespace {

using alidade::testing::FrameAt;
using alidade::testing::HasEvent;
using alidade::testing::LargestDifference;
using alidade::testing::ManifoldInvariantsHold;
using alidade::testing::NumericSensorJacobian;
using alidade::testing::NumericStep;
using alidade::testing::SensorJacobian;
using alidade::testing::StepResult;
using alidade::testing::StepWithJacobians;
using alidade::testing::ValueOf;

TEST(StereoDisparity, HasTheJacobianOfDifferences) {
  const auto stereo = alidade::MakeSensor(alidade::StereoDisparity(400.0, 0.065, 1.0));
  EXPECT_LT(
      LargestDifference(SensorJacobian(stereo, {{0.5}}), NumericSensorJacobian(stereo, {{0.5}})),
      1e-8);
}

TEST(ConstantVelocity, HasTheJacobiansOfDifferences) {
  const auto motion = alidade::MakeMotion(alidade::ConstantVelocity<1, false>(1.0));
  const double noise[] = {0.3};
  const StepResult step = StepWithJacobians(motion, {{0.5}, {-0.1}}, nullptr, noise, 0.2),
                   numeric = NumericStep(motion, {{0.5}, {-0.1}}, nullptr, noise, 0.2);
  EXPECT_LT(LargestDifference(step.f, numeric.f), 1e-9);
  EXPECT_LT(LargestDifference(step.g, numeric.g), 1e-9);
}

TEST(DepthFilter, FollowsTheDisparityAndReportsAStaleFrame) {
  alidade::Problem problem;
  const auto target = problem.AddState("target", alidade::ConstantVelocity<1, false>(1.0),
                                       {{"position", 0.3, 0.1}, {"velocity", 0.0, 0.1}});
  const auto stereo = problem.AddSensor("stereo", alidade::StereoDisparity(400.0, 0.065, 1.0),
                                        {target["position"]});
  alidade::Ekf filter(problem);
  for (int k = 0; k < 10; ++k) filter.Process(FrameAt(0.1 * k, {{stereo.stream, 65.0}}));
  EXPECT_NEAR(ValueOf(filter.state(), "target.position"), 0.4, 0.005);  // 26 px m / 65 px
  EXPECT_TRUE(
      HasEvent(filter.Process(FrameAt(0.5, {{stereo.stream, 65.0}})), alidade::EventKind::kStale));
}

TEST(UnitQuaternion, IsAManifold) {
  EXPECT_TRUE(ManifoldInvariantsHold(alidade::Geometry::UnitQuaternion(), {0.6, 0.8, 0.0, 0.0},
                                     {0.1, 2.0, -1.0}, {0.0, 0.0, -0.6, 0.8}, 1e-14));
}

}  // namespace
