// SPDX-License-Identifier: Apache-2.0
#include "pose.h"

#include "alidade/model/bound_roles.h"
#include "alidade/model/plugin.h"

namespace {

void Make(alidade::Params& p, AlidadeInstance* instance) {
  alidade::BoundRoles(p).VisitSize<2, 3>(
      "position", [&](auto size) { alidade::EmplaceSensor<alidade::Pose<size()>>(p, instance); });
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(Make, "pose", "position and attitude with a joint covariance",
                                 "[Sola2017] ch. 4"))
