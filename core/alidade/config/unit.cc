// SPDX-License-Identifier: Apache-2.0
#include "alidade/config/unit.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"

namespace alidade::internal {
namespace {

/// Dimension of a unit.
enum Dimension {
  kLength,
  kTime,
  kAngle,
  kFrequency,
  kPixels,
  kArea,
  kTimeSquared,
  kPixelArea,
  kAngleSquared,
  kMass,
  kRatio
};

constexpr const char* kSiNames[] = {"m",   "s",    "rad",   "Hz", "px", "m^2",
                                    "s^2", "px^2", "rad^2", "kg", ""};

struct NamedUnit {
  std::string_view name;
  Dimension dimension;
  double factor;
};

constexpr double kDegree = std::numbers::pi / 180.0;
// "min" is omitted, because in a key it means "minimum" more often than "minute".
constexpr NamedUnit kUnits[] = {
    {"m", kLength, 1.0},         {"mm", kLength, 1e-3},
    {"cm", kLength, 1e-2},       {"km", kLength, 1e3},
    {"um", kLength, 1e-6},       {"nm", kLength, 1e-9},
    {"in", kLength, 0.0254},     {"inch", kLength, 0.0254},
    {"ft", kLength, 0.3048},     {"s", kTime, 1.0},
    {"sec", kTime, 1.0},         {"ms", kTime, 1e-3},
    {"us", kTime, 1e-6},         {"ns", kTime, 1e-9},
    {"h", kTime, 3600.0},        {"rad", kAngle, 1.0},
    {"deg", kAngle, kDegree},    {"mrad", kAngle, 1e-3},
    {"hz", kFrequency, 1.0},     {"khz", kFrequency, 1e3},
    {"mhz", kFrequency, 1e6},    {"px", kPixels, 1.0},
    {"pixel", kPixels, 1.0},     {"pixels", kPixels, 1.0},
    {"m2", kArea, 1.0},          {"mm2", kArea, 1e-6},
    {"cm2", kArea, 1e-4},        {"s2", kTimeSquared, 1.0},
    {"ms2", kTimeSquared, 1e-6}, {"px2", kPixelArea, 1.0},
    {"rad2", kAngleSquared, 1},  {"deg2", kAngleSquared, kDegree* kDegree},
    {"kg", kMass, 1.0},          {"g", kMass, 1e-3},
    {"percent", kRatio, 1e-2},   {"%", kRatio, 1e-2},
};

const NamedUnit* FindUnit(std::string_view name) {
  const auto* unit = std::find_if(std::begin(kUnits), std::end(kUnits),
                                  [&](const NamedUnit& u) { return u.name == name; });
  return unit == std::end(kUnits) ? nullptr : unit;
}

/// Multiplies `unit` by its first factor, or divides it by a further factor.
void AppendFactor(const NamedUnit& factor, Unit& unit) {
  const bool is_first = unit.dimensions.empty();
  unit.dimensions.push_back(factor.dimension);
  unit.factor = is_first ? factor.factor : unit.factor / factor.factor;
  unit.si += (is_first ? "" : "/") + std::string(kSiNames[factor.dimension]);
}

}  // namespace

std::optional<Unit> ParseUnit(std::string_view text) {
  std::string lower = LowerCase(text);
  std::erase(lower, '^');
  Unit unit;
  for (std::string_view remaining = lower;;) {
    const std::size_t end = std::min(remaining.find('/'), remaining.size());
    const NamedUnit* const factor = FindUnit(remaining.substr(0, end));
    if (factor == nullptr) return std::nullopt;
    AppendFactor(*factor, unit);
    if (end == remaining.size()) return unit;
    remaining.remove_prefix(end + 1);
  }
}

KeyParts SplitUnit(std::string_view key) {
  KeyParts parts{key, {}, {}};
  std::vector<const NamedUnit*> factors;
  for (;;) {
    const std::size_t cut = parts.stem.rfind('_');
    if (cut == std::string_view::npos || cut == 0) break;
    const NamedUnit* const factor = FindUnit(parts.stem.substr(cut + 1));
    if (factor == nullptr) break;
    factors.insert(factors.begin(), factor);
    parts.stem = key.substr(0, cut);
    parts.suffix = key.substr(cut + 1);
  }
  for (const NamedUnit* const factor : factors) AppendFactor(*factor, parts.unit);
  return parts;
}

std::optional<Quantity> ParseQuantity(std::string_view text) {
  Quantity quantity;
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, quantity.value);
  if (error != std::errc() || end == last || !std::isfinite(quantity.value)) return std::nullopt;
  std::string_view name(end, static_cast<std::size_t>(last - end));
  name.remove_prefix(std::min(name.find_first_not_of(' '), name.size()));
  const auto unit = ParseUnit(name);
  if (!unit) return std::nullopt;
  quantity.unit = *unit;
  return quantity;
}

std::string ConvertedText(const Quantity& quantity, const Unit& unit) {
  constexpr int kDigits = 9;
  return RoundedText(quantity.value * quantity.unit.factor / unit.factor, kDigits);
}

}  // namespace alidade::internal
