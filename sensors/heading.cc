// SPDX-License-Identifier: Apache-2.0
#include "heading.h"

#include "alidade/model/bound_roles.h"
#include "alidade/model/plugin.h"

namespace alidade {
namespace {

void Make(Params& p, AlidadeInstance* instance) {
  if (BoundRoles(p).Find("orientation") != nullptr) {
    EmplaceSensor<HeadingOfOrientation>(p, instance);
  } else {
    EmplaceSensor<HeadingOfAngle>(p, instance);
  }
}

}  // namespace
}  // namespace alidade

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(alidade::Make, "heading",
                                 "heading of a body, such as that of a compass",
                                 "[Groves2013] sec. 6.1.1"))
