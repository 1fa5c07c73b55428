// SPDX-License-Identifier: Apache-2.0
#include "range.h"

#include "alidade/model/bound_roles.h"
#include "alidade/model/fixed_known.h"

namespace {

void Make(alidade::Params& p, AlidadeInstance* instance) {
  alidade::BoundRoles(p).VisitSize<2, 3>("position", [&](auto size) {
    alidade::EmplaceKnown<alidade::RangeToPoint<size()>>(p, instance);
  });
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(Make, "range", "range from a body to a known point",
                                 "[Groves2013] sec. 7.1"))
