// SPDX-License-Identifier: Apache-2.0
#include "data_unit.h"

#include <algorithm>
#include <numbers>
#include <string_view>
#include <utility>

#include "alidade/config/unit.h"

namespace alidade {
namespace {

constexpr double kGravity = 9.80665, kNauticalMile = 1852.0, kMile = 1609.344, kHour = 3600.0;

constexpr std::pair<std::string_view, double> kFactors[] = {
    {"g", kGravity},
    {"mg", 1e-3 * kGravity},
    {"kn", kNauticalMile / kHour},
    {"mph", kMile / kHour},
    {"rpm", 2.0 * std::numbers::pi / 60.0},
    {"nmi", kNauticalMile},
    {"mi", kMile},
    {"Pa", 1.0},
    {"hPa", 1e2},
    {"mbar", 1e2},
    {"kPa", 1e3},
    {"bar", 1e5},
    {"T", 1e6},
    {"mT", 1e3},
    {"uT", 1.0},
    {"nT", 1e-3},
    {"gauss", 100.0},
};

std::optional<double> FactorOf(std::string_view name) {
  const auto* const found =
      std::ranges::find(kFactors, name, &std::pair<std::string_view, double>::first);
  if (found != std::end(kFactors)) return found->second;
  const auto unit = internal::ParseUnit(name);
  return unit ? std::optional(unit->factor) : std::nullopt;
}

}  // namespace

std::optional<double> DataUnitFactor(const std::string& unit) {
  std::optional<double> product;
  for (std::string_view remaining = unit;;) {
    const std::size_t end = std::min(remaining.find('/'), remaining.size());
    const std::optional<double> factor = FactorOf(remaining.substr(0, end));
    if (!factor) return std::nullopt;
    product = product ? *product / *factor : *factor;
    if (end == remaining.size()) return product;
    remaining.remove_prefix(end + 1);
  }
}

}  // namespace alidade
