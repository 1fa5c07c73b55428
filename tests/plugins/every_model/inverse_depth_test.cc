// SPDX-License-Identifier: Apache-2.0
#include "every_model_fixture.h"
#include "sensors/inverse_depth_feature.h"

namespace alidade::testing {
namespace {

INSTANTIATE_TEST_SUITE_P(
    InverseDepth, EveryModel,
    ::testing::Values(SensorRow("inverse_depth_feature", "{sigma_px: 1, " + kSmallCameraText + "}",
                                InverseDepthFeature<InverseDepth>(kSmallCamera, 1.0),
                                {kPosition, kOrientation, {0, 0, 0, 0.1, -0.2, 0.5}})),
    RowName);

}  // namespace
}  // namespace alidade::testing
