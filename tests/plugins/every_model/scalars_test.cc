// SPDX-License-Identifier: Apache-2.0
#include "every_model_fixture.h"
#include "motion_models/constant.h"
#include "sensors/scale_2d.h"
#include "sensors/stereo_disparity.h"

namespace alidade::testing {
namespace {

INSTANTIATE_TEST_SUITE_P(
    Scalars, EveryModel,
    ::testing::Values(MotionRow("constant", "{}", Constant<1>(1), {{0.7}}),
                      StaticMotionRow("constant", "{size: 2, noise: {random_walk: 0.3}}",
                                      Constant<2>(2, 0.3), {{0.7, -0.2}}),
                      MotionRow("constant_velocity", "{noise: {kind: discrete, acceleration: 0.4}}",
                                ConstantVelocity<1, false>(0.4), {{1.0}, {0.1}}),
                      MotionRow("constant_velocity",
                                "{dimensions: 2, noise: {kind: continuous, acceleration: 0.4}}",
                                ConstantVelocity<2, true>(0.4), {{1.0, 2.0}, {0.1, -0.1}}),
                      StaticMotionRow("constant_velocity",
                                      "{dimensions: 3, noise: {kind: discrete, acceleration: 0.4}}",
                                      ConstantVelocity<3, false>(0.4),
                                      {{1.0, 2.0, 3.0}, {0.1, 0.0, -0.1}}),
                      SensorRow("stereo_disparity",
                                "{focal_px: 400, baseline_m: 0.065, sigma_px: 1.0}",
                                StereoDisparity(400.0, 0.065, 1.0), {{0.7}}),
                      StaticSensorRow("scale_2d", "{template_px: 300, sigma_px: 1.0}",
                                      Scale2d::FromPixels(300.0, 1.0), {{0.7}, {1.4}}),
                      SensorRow("scale_2d", "{noise_model: constant, sigma_inverse_scale: 0.05}",
                                Scale2d::FromSigma(0.05), {{0.7}, {1.4}})),
    RowName);

}  // namespace
}  // namespace alidade::testing
