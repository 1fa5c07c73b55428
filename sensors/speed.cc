// SPDX-License-Identifier: Apache-2.0
#include "speed.h"

#include "alidade/model/bound_roles.h"
#include "alidade/model/plugin.h"

namespace {

void Make(alidade::Params& p, AlidadeInstance* instance) {
  alidade::BoundRoles(p).VisitSize<1, 3>(
      "velocity", [&](auto size) { alidade::EmplaceSensor<alidade::Speed<size()>>(p, instance); });
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(Make, "speed", "speed of a body, the length of its velocity",
                                 "[Groves2013] sec. 6.3"))
