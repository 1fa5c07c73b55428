// SPDX-License-Identifier: Apache-2.0
#include "every_model_fixture.h"
#include "sensors/inverse_depth_feature.h"

namespace alidade::testing {
namespace {

INSTANTIATE_TEST_SUITE_P(Anchored, EveryModel,
                         ::testing::Values(StaticSensorRow(
                             "inverse_depth_feature",
                             "{sigma_px: 1, landmarks: {representation: anchored}, " +
                                 kSmallCameraText + "}",
                             InverseDepthFeature<Anchored>(kSmallCamera, 1.0),
                             {kPosition, kOrientation, {0, 0, 0}, {0.0, 0.28, 0.96}, {0.5}})),
                         RowName);

}  // namespace
}  // namespace alidade::testing
