// SPDX-License-Identifier: Apache-2.0
#include "position.h"

#include "alidade/model/bound_roles.h"
#include "alidade/model/plugin.h"

namespace {

void Make(alidade::Params& p, AlidadeInstance* instance) {
  alidade::BoundRoles(p).VisitSize<2, 3>("position", [&](auto size) {
    alidade::EmplaceSensor<alidade::Position<size()>>(p, instance);
  });
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(Make, "position",
                                 "position of a point on a body, in the plane or in space",
                                 "[Groves2013] sec. 14.3.2"))
