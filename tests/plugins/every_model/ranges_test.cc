// SPDX-License-Identifier: Apache-2.0
#include "every_model_fixture.h"
#include "sensors/pseudorange_rate.h"
#include "sensors/radar.h"
#include "sensors/range.h"
#include "sensors/tdoa.h"

namespace alidade::testing {
namespace {

INSTANTIATE_TEST_SUITE_P(
    Ranges, EveryModel,
    ::testing::Values(
        SensorRow("range", "{roles: {position: vector(2)}, sigma_m: 0.1}", RangeToPoint<2>(0.1),
                  {{0.1, -0.1}, {0.5}, {0.2, 0.1}, {0.1}}),
        SensorRow("tdoa", "{roles: {position: vector(2)}, sigma_m: 0.1}", Tdoa<2>(0.1),
                  {{0.1, -0.1}, {0.1}}),
        SensorRow("pseudorange_rate", "{sigma_m_s: 0.1}", PseudorangeRate(0.1),
                  {kPosition, {0.3, -0.2, 0.1}, {0.2}}),
        SensorRow("radar",
                  "{roles: {position: vector(2)}, sigma_range_m: 0.1, sigma_azimuth_rad: 0.01, "
                  "sigma_range_rate_m_s: 0.1}",
                  Radar<2, true, true, true>({0.1, 0.01, 0.1}),
                  {{8.0, 5.0}, {-1.0, 2.0}, {0.1, -0.2}, {0.0, 0.0}}),
        SensorRow(
            "radar",
            "{roles: {position: vector(3)}, sigma_azimuth_rad: 0.01, sigma_elevation_rad: 0.02}",
            Radar<3, false, true, false>({0.01, 0.02}),
            {{8.0, 5.0, 3.0}, {-1.0, 2.0, 0.1}, {0.1, -0.2, 0.0}, {0.0, 0.0, 0.0}})),
    RowName);

}  // namespace
}  // namespace alidade::testing
