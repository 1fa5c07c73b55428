// SPDX-License-Identifier: Apache-2.0
#include "turn_rate.h"

#include "alidade/model/bound_roles.h"
#include "alidade/model/plugin.h"

namespace alidade {
namespace {

void Make(Params& p, AlidadeInstance* instance) {
  if (BoundRoles(p).Find("angular_velocity") != nullptr) {
    EmplaceSensor<TurnRate<3>>(p, instance);
  } else {
    EmplaceSensor<TurnRate<2>>(p, instance);
  }
}

}  // namespace
}  // namespace alidade

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(alidade::Make, "turn_rate",
                                 "turn rate or angular velocity, measured by a gyroscope",
                                 "[Groves2013] sec. 4.4"))
