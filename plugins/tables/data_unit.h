// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

namespace alidade {

/// Units of recorded data, in addition to the units that a config may use anywhere.
inline constexpr const char* kDataUnits =
    "g, mg (standard gravity), kn, mph, rpm, nmi, mi, Pa, hPa, mbar, kPa, bar, T, mT, uT, nT, "
    "gauss";

/// Returns the value of a unit in SI units, such as pi/180 for `deg`, or 1/3.6 for `km/h`. The
/// value of a unit of the magnetic field is in uT, the unit of sensor magnetometer. A slash divides
/// by each further unit. Returns nullopt if the unit is unknown. In data, `g` is the standard
/// gravity, not the gram.
std::optional<double> DataUnitFactor(const std::string& unit);

}  // namespace alidade
