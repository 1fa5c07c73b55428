// SPDX-License-Identifier: Apache-2.0
#include "tdoa.h"

#include "alidade/model/bound_roles.h"
#include "alidade/model/fixed_known.h"

namespace {

void Make(alidade::Params& p, AlidadeInstance* instance) {
  alidade::BoundRoles(p).VisitSize<2, 3>(
      "position", [&](auto size) { alidade::EmplaceKnown<alidade::Tdoa<size()>>(p, instance); });
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(Make, "tdoa", "difference of the ranges to two known anchors",
                                 "[Groves2013] sec. 7.1.4"))
