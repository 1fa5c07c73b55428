// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "alidade/config/tree.h"

namespace alidade::internal {
namespace {

struct Unit {
  std::string_view name;
  int dimension;
};

// "min" is left out: in a key it is a minimum more often than a minute.
constexpr Unit kUnits[] = {
    {"m", 0},    {"mm", 0},    {"cm", 0},     {"km", 0},   {"um", 0},  {"nm", 0},  {"in", 0},
    {"inch", 0}, {"ft", 0},    {"s", 1},      {"sec", 1},  {"ms", 1},  {"us", 1},  {"ns", 1},
    {"h", 1},    {"rad", 2},   {"deg", 2},    {"mrad", 2}, {"hz", 3},  {"khz", 3}, {"mhz", 3},
    {"px", 4},   {"pixel", 4}, {"pixels", 4}, {"m2", 5},   {"mm2", 5}, {"cm2", 5}, {"s2", 6},
    {"ms2", 6},  {"px2", 7},   {"rad2", 8},   {"deg2", 8}, {"kg", 9},  {"g", 9},   {"percent", 10},
};

const Unit* FindUnit(std::string_view name) {
  const auto* unit = std::find_if(std::begin(kUnits), std::end(kUnits),
                                  [&](const Unit& u) { return u.name == name; });
  return unit == std::end(kUnits) ? nullptr : unit;
}

/// `rate_deg_s` as the stem `rate` and the unit `deg_s`.
struct Measure {
  std::string_view stem;
  std::string_view unit;
  std::vector<int> dimensions;
};

Measure Split(std::string_view key) {
  Measure measure{key, {}, {}};
  for (;;) {
    const std::size_t cut = measure.stem.rfind('_');
    if (cut == std::string_view::npos || cut == 0) return measure;
    const Unit* unit = FindUnit(measure.stem.substr(cut + 1));
    if (unit == nullptr) return measure;
    measure.dimensions.push_back(unit->dimension);
    measure.stem = key.substr(0, cut);
    measure.unit = key.substr(cut + 1);
  }
}

}  // namespace

std::string UnitSlip(std::string_view written, std::string_view known, bool same_dimension) {
  const Measure a = Split(written);
  const Measure b = Split(known);
  if (a.unit.empty() || b.unit.empty() || a.stem != b.stem || a.unit == b.unit) return {};
  if (same_dimension && a.dimensions != b.dimensions) return {};
  return std::string(a.unit);
}

}  // namespace alidade::internal
