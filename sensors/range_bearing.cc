// SPDX-License-Identifier: Apache-2.0
#include "range_bearing.h"

#include "alidade/model/bound_roles.h"
#include "alidade/model/fixed_known.h"

namespace alidade {
namespace {

void Make(Params& p, AlidadeInstance* instance) {
  const BoundRoles roles(p);
  const BoundRoles::Role* const position = roles.Find("position");
  if (position == nullptr || position->VectorSize() != 2) {
    WithRepresentation(ReadLandmarkRepresentation(p), [&](auto representation) {
      EmplaceSensor<RangeBearing<decltype(representation)>>(p, instance);
    });
  } else if (roles.Find("landmark") != nullptr) {
    EmplaceSensor<PlanarRangeBearingOfLandmark>(p, instance);
  } else {
    EmplaceKnown<PlanarRangeBearingOfPoint>(p, instance);
  }
}

}  // namespace
}  // namespace alidade

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(alidade::Make, "range_bearing",
                                 "range and bearing of a landmark, in the plane also of a point",
                                 "[Thrun2005] sec. 6.6"))
