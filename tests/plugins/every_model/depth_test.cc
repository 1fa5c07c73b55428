// SPDX-License-Identifier: Apache-2.0
#include "every_model_fixture.h"
#include "sensors/depth_feature.h"

namespace alidade::testing {
namespace {

INSTANTIATE_TEST_SUITE_P(
    Depth, EveryModel,
    ::testing::Values(SensorRow(
        "depth_feature",
        "{sigma_px: 1, sigma_depth_m: 0.1, landmarks: {representation: xyz}, " + kSmallCameraText +
            "}",
        DepthFeature<Xyz>(kSmallCamera, 1.0, 0.1), {kPosition, kOrientation, {0.2, 0.4, 2.0}})),
    RowName);

}  // namespace
}  // namespace alidade::testing
