// SPDX-License-Identifier: Apache-2.0
#include "every_model_fixture.h"
#include "sensors/self_calibrating_feature.h"

namespace alidade::testing {
namespace {

INSTANTIATE_TEST_SUITE_P(
    Radtan, EveryModel,
    ::testing::Values(SensorRow(
        "self_calibrating_feature", "{lens: radtan, sigma_px: 1}",
        SelfCalibratingFeature<RadtanLens>(1.0),
        {kPosition, kOrientation, {20, 16, 12, -0.1, 0.05, 0.0, 0.0, 0.0}, {0.2, 0.4, 2.0}})),
    RowName);

}  // namespace
}  // namespace alidade::testing
