// SPDX-License-Identifier: Apache-2.0
#include "every_model_fixture.h"
#include "motion_models/clock.h"
#include "motion_models/constant_acceleration.h"
#include "motion_models/gauss_markov.h"
#include "motion_models/singer.h"

namespace alidade::testing {
namespace {

INSTANTIATE_TEST_SUITE_P(
    Points, EveryModel,
    ::testing::Values(
        MotionRow("gauss_markov", "{size: 2, time_constant_s: 3, noise: {sigma: 0.3}}",
                  GaussMarkov<2>(2, 3.0, 0.3), {{0.7, -0.2}}),
        MotionRow("constant_acceleration", "{dimensions: 2, noise: {kind: continuous, jerk: 0.4}}",
                  ConstantAcceleration<2, true>(0.4), {{1.0, 2.0}, {0.1, -0.1}, {0.0, 0.1}}),
        MotionRow("constant_acceleration", "{noise: {kind: discrete, jerk: 0.4}}",
                  ConstantAcceleration<1, false>(0.4), {{1.0}, {0.1}, {-0.1}}),
        MotionRow("singer", "{dimensions: 2, time_constant_s: 5, noise: {acceleration: 0.4}}",
                  Singer<2>(0.4, 5.0), {{1.0, 2.0}, {0.1, -0.1}, {0.0, 0.1}}),
        MotionRow("clock", "{noise: {bias: 0.1, drift: 0.2}}", Clock<true>(0.1, 0.2),
                  {{0.7}, {0.1}}),
        MotionRow("clock", "{unit: s, noise_model: power_law, h_0: 0.02, h_minus_2: 0.001}",
                  Clock<false>::FromPowerLaw(0.02, 0.001), {{0.7}, {0.1}})),
    RowName);

}  // namespace
}  // namespace alidade::testing
