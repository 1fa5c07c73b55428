// SPDX-License-Identifier: Apache-2.0
#include "altitude.h"

#include "alidade/model/bound_roles.h"
#include "alidade/model/plugin.h"

namespace alidade {
namespace {

template <int H>
void Emplace(bool is_pressure, Params& p, AlidadeInstance* instance) {
  if (is_pressure) {
    EmplaceSensor<Altitude<H, true>>(p, instance);
  } else {
    EmplaceSensor<Altitude<H, false>>(p, instance);
  }
}

void Make(Params& p, AlidadeInstance* instance) {
  const bool is_pressure = p.Choice("measures", {"height", "pressure"},
                                    "height, or pressure of the standard atmosphere", 0) == 1;
  if (BoundRoles(p).Find("position") != nullptr) {
    Emplace<3>(is_pressure, p, instance);
  } else {
    Emplace<1>(is_pressure, p, instance);
  }
}

}  // namespace
}  // namespace alidade

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(alidade::Make, "altitude",
                                 "height of a body, or pressure at this height", "[Icao1993]"))
