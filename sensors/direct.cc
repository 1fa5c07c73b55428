// SPDX-License-Identifier: Apache-2.0
#include "direct.h"

#include "alidade/model/bound_roles.h"
#include "alidade/model/plugin.h"

namespace alidade {
namespace {

void Make(Params& p, AlidadeInstance* instance) {
  const BoundRoles roles(p);
  const BoundRoles::Role* const value = roles.Find("value");
  const std::string geometry = value == nullptr ? "vector(1)" : value->geometry;
  if (geometry == "angle") {
    EmplaceSensor<Direct<Angle>>(p, instance);
  } else if (geometry == "unit_quaternion") {
    EmplaceSensor<Direct<UnitQuaternion>>(p, instance);
  } else if (geometry == "unit_vector") {
    EmplaceSensor<Direct<UnitVector>>(p, instance);
  } else if (value == nullptr) {
    EmplaceSensor<Direct<Vec<1>>>(p, instance);
  } else {
    roles.VisitSize<1, 9>("value",
                          [&](auto size) { EmplaceSensor<Direct<Vec<size()>>>(p, instance); });
  }
}

}  // namespace
}  // namespace alidade

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(alidade::Make, "direct",
                                 "measured value of a block of any geometry", "[Sola2017] ch. 4"))
