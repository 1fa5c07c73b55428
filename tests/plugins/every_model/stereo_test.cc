// SPDX-License-Identifier: Apache-2.0
#include "every_model_fixture.h"
#include "sensors/stereo_feature.h"

namespace alidade::testing {
namespace {

INSTANTIATE_TEST_SUITE_P(Stereo, EveryModel,
                         ::testing::Values(SensorRow(
                             "stereo_feature",
                             "{sigma_px: 1, camera: {baseline_m: 0.5, " + kSmallCameraKeys + "}}",
                             StereoFeature<InverseDepth>(kSmallCamera, 0.5, 1.0),
                             {kPosition, kOrientation, {0, 0, 0, 0.1, -0.2, 0.5}})),
                         RowName);

}  // namespace
}  // namespace alidade::testing
