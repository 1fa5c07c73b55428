// SPDX-License-Identifier: Apache-2.0
#include "relative_pose.h"

#include "alidade/model/bound_roles.h"
#include "alidade/model/plugin.h"

namespace {

void Make(alidade::Params& p, AlidadeInstance* instance) {
  alidade::BoundRoles(p).VisitSize<2, 3>("position", [&](auto size) {
    alidade::EmplaceSensor<alidade::RelativePose<size()>>(p, instance);
  });
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(Make, "relative_pose",
                                 "pose of a landmark relative to the body: a tag, or a keyframe",
                                 "[Roumeliotis2002]"))
