// SPDX-License-Identifier: Apache-2.0
#include "bearing.h"

#include "alidade/model/bound_roles.h"
#include "alidade/model/fixed_known.h"

namespace alidade {
namespace {

void Make(Params& p, AlidadeInstance* instance) {
  BoundRoles(p).VisitSize<2, 3>("position", [&](auto size) {
    if constexpr (size() == 2) {
      EmplaceKnown<Bearing>(p, instance);
    } else if (p.Choice("measures", {"unit_vector", "angles"},
                        "a unit vector, or azimuth and elevation; only in space", 0) == 0) {
      EmplaceKnown<BearingUnitVector>(p, instance);
    } else {
      EmplaceKnown<BearingAngles>(p, instance);
    }
  });
}

}  // namespace
}  // namespace alidade

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(alidade::Make, "bearing", "direction from a body to a known point",
                                 "[Thrun2005] sec. 6.6"))
