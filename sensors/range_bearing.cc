// SPDX-License-Identifier: Apache-2.0
#include "range_bearing.h"

#include "alidade/model/bound_roles.h"
#include "alidade/model/fixed_known.h"

namespace alidade {
namespace {

template <int D>
void MakeIn(Params& p, AlidadeInstance* instance) {
  if (p.Choice("target", {"landmark", "point"}, "a landmark, or a known point", 0) == 1) {
    EmplaceKnown<RangeBearingToPoint<D>>(p, instance);
  } else if constexpr (D == 2) {
    EmplaceSensor<PlanarRangeBearing>(p, instance);
  } else {
    WithRepresentation(ReadLandmarkRepresentation(p), [&](auto representation) {
      EmplaceSensor<RangeBearing<decltype(representation)>>(p, instance);
    });
  }
}

void Make(Params& p, AlidadeInstance* instance) {
  const BoundRoles roles(p);
  const BoundRoles::Role* const position = roles.Find("position");
  if (position != nullptr && position->VectorSize() == 2) {
    MakeIn<2>(p, instance);
  } else {
    MakeIn<3>(p, instance);
  }
}

}  // namespace
}  // namespace alidade

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(alidade::Make, "range_bearing",
                                 "range and bearing of a landmark or of a known point",
                                 "[Thrun2005] sec. 6.6"))
