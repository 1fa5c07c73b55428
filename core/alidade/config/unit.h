// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// Units of measurement in keys (`rate_deg_s`), in values (`3deg/s`) and of parameters (`rad/s`).
namespace alidade::internal {

/// Unit, such as `deg/s`: the first factor, divided by the other factors.
struct Unit {
  std::vector<int> dimensions;  ///< dimension of each factor, such as length or time
  double factor = 1.0;          ///< value of the unit in SI units, or in px
  std::string si;               ///< name of the unit of `factor`, such as `rad/s`
};

/// Parses a unit such as `mm`, `deg/s` or `m/s^2`. Returns nullopt if the unit is unknown.
std::optional<Unit> ParseUnit(std::string_view text);

/// Parts of a key: `rate_deg_s` has the stem `rate` and the suffix `deg_s`, the unit deg/s.
struct KeyParts {
  std::string_view stem;
  std::string_view suffix;  ///< empty if the key does not end in a unit
  Unit unit;
};
KeyParts SplitUnit(std::string_view key);

/// Number with a unit in a value that must be a number, such as `65mm` or `3 deg/s`.
struct Quantity {
  double value = 0.0;
  Unit unit = {};
};
/// Parses a number that a known unit follows. Returns nullopt for any other text.
std::optional<Quantity> ParseQuantity(std::string_view text);

/// Returns the value of `quantity` in `unit`, which must have the same dimensions.
std::string ConvertedText(const Quantity& quantity, const Unit& unit);

}  // namespace alidade::internal
