// SPDX-License-Identifier: Apache-2.0
#include "quaternion_pose.h"

#include "alidade/model/plugin.h"

namespace {

void MakeQuaternionPose(alidade::Params& p, AlidadeInstance* instance) {
  const int kind =
      p.Choice("noise.kind", {"continuous", "discrete"},
               "white accelerations, or accelerations that are constant between updates", 0);
  if (kind == 0) {
    alidade::EmplaceMotion<alidade::ContinuousQuaternionPose>(p, instance);
  } else {
    alidade::EmplaceMotion<alidade::QuaternionPose>(p, instance);
  }
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_MOTION_BY(MakeQuaternionPose, "quaternion_pose",
                                 "a rigid body with constant velocities and random accelerations",
                                 "[MonoSlam2015] sec. 4.3, [Davison2007]; [BarShalom2001]"))
