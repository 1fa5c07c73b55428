// SPDX-License-Identifier: Apache-2.0
#include "zero.h"

#include "alidade/model/bound_roles.h"
#include "alidade/model/plugin.h"

namespace {

void Make(alidade::Params& p, AlidadeInstance* instance) {
  alidade::BoundRoles(p).VisitSize<1, 6>("velocity", [&](auto size) {
    alidade::EmplaceSensor<alidade::ZeroVelocity<size()>>(p, instance);
  });
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(Make, "zero", "velocity that is zero at the times of a stream",
                                 "[Groves2013] sec. 15.3"))
