// SPDX-License-Identifier: Apache-2.0
#include "data_unit.h"

#include <algorithm>
#include <numbers>
#include <string_view>

#include "alidade/config/unit.h"

namespace alidade {
namespace {

constexpr double kGravity = 9.80665, kNauticalMile = 1852.0, kMile = 1609.344, kHour = 3600.0;

/// Unit, with its value in the unit `si`.
struct NamedUnit {
  std::string_view name;
  double factor;
  std::string_view si;
};

constexpr NamedUnit kUnits[] = {
    {"g", kGravity, "m/s^2"},
    {"mg", 1e-3 * kGravity, "m/s^2"},
    {"kn", kNauticalMile / kHour, "m/s"},
    {"mph", kMile / kHour, "m/s"},
    {"rpm", 2.0 * std::numbers::pi / 60.0, "rad/s"},
    {"nmi", kNauticalMile, "m"},
    {"mi", kMile, "m"},
    {"Pa", 1.0, "Pa"},
    {"hPa", 1e2, "Pa"},
    {"mbar", 1e2, "Pa"},
    {"kPa", 1e3, "Pa"},
    {"bar", 1e5, "Pa"},
    {"T", 1e6, "uT"},
    {"mT", 1e3, "uT"},
    {"uT", 1.0, "uT"},
    {"nT", 1e-3, "uT"},
    {"gauss", 100.0, "uT"},
};

/// Calls `use(factor, is_first)` for each factor of a unit such as `m/s^2`, until it returns false.
template <class F>
bool ForEachFactor(std::string_view unit, const F& use) {
  for (bool is_first = true;; is_first = false) {
    const std::size_t end = std::min(unit.find('/'), unit.size());
    if (!use(unit.substr(0, end), is_first)) return false;
    if (end == unit.size()) return true;
    unit.remove_prefix(end + 1);
  }
}

/// Multiplies `product` by a unit that consists of SI units, or divides it by this unit.
void AppendSi(std::string_view units, double factor, bool divides, DataUnit& product) {
  product.factor = divides ? product.factor / factor : product.factor * factor;
  ForEachFactor(units, [&](std::string_view base, bool is_first) {
    const std::size_t caret = std::min(base.find('^'), base.size());
    const int exponent = caret == base.size() ? 1 : base[caret + 1] - '0';
    int& total = product.dimensions[std::string(base.substr(0, caret))];
    total += is_first != divides ? exponent : -exponent;
    return true;
  });
}

}  // namespace

std::optional<DataUnit> ParseDataUnit(const std::string& unit) {
  DataUnit product{1.0, {}};
  const auto append = [&](std::string_view name, bool is_first) {
    const auto* const found = std::ranges::find(kUnits, name, &NamedUnit::name);
    const auto general = internal::ParseUnit(name);
    if (found == std::end(kUnits) && !general) return false;
    const bool is_of_data = found != std::end(kUnits);
    AppendSi(is_of_data ? found->si : general->si, is_of_data ? found->factor : general->factor,
             !is_first, product);
    return true;
  };
  if (!ForEachFactor(unit, append)) return std::nullopt;
  std::erase_if(product.dimensions, [](const auto& entry) { return entry.second == 0; });
  product.dimensions.erase("");  // a ratio
  return product;
}

}  // namespace alidade
