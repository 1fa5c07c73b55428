// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>

namespace alidade {

/// Units of recorded data, in addition to the units that a config may use anywhere.
inline constexpr const char* kDataUnits =
    "g, mg (standard gravity), kn, mph, rpm, nmi, mi, Pa, hPa, mbar, kPa, bar, T, mT, uT, nT, "
    "gauss";

/// Unit of recorded data.
struct DataUnit {
  double factor;                          ///< value in SI units, such as 1/3.6 for `km/h`
  std::map<std::string, int> dimensions;  ///< exponents of SI units, such as m: 1 and s: -1
};

/// Parses a unit. The value of a unit of the magnetic field is in uT, the unit of sensor
/// magnetometer. A slash divides by each further unit. Returns nullopt if the unit is unknown. In
/// data, `g` is the standard gravity, not the gram.
std::optional<DataUnit> ParseDataUnit(const std::string& unit);

}  // namespace alidade
