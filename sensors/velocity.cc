// SPDX-License-Identifier: Apache-2.0
#include "velocity.h"

#include "alidade/model/bound_roles.h"
#include "alidade/model/plugin.h"

namespace {

void Make(alidade::Params& p, AlidadeInstance* instance) {
  alidade::BoundRoles(p).VisitSize<2, 3>("velocity", [&](auto size) {
    alidade::EmplaceSensor<alidade::Velocity<size()>>(p, instance);
  });
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(Make, "velocity", "velocity of a point on a body, in the world",
                                 "[Groves2013] sec. 14.3.2"))
