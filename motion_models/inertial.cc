// SPDX-License-Identifier: Apache-2.0
#include "inertial.h"

#include "alidade/model/plugin.h"

namespace {

void MakeInertial(alidade::Params& p, AlidadeInstance* instance) {
  using Integration = alidade::InertialIntegration;
  const int integration =
      p.Choice("integration", {"exact", "euler", "midpoint"},
               "how the specific force is integrated while the body turns: exactly for readings "
               "that are constant over a step, with the orientation at its start, or in its middle",
               0);
  if (integration == 0) alidade::EmplaceMotion<alidade::Inertial<Integration::kExact>>(p, instance);
  if (integration == 1) alidade::EmplaceMotion<alidade::Inertial<Integration::kEuler>>(p, instance);
  if (integration == 2) {
    alidade::EmplaceMotion<alidade::Inertial<Integration::kMidpoint>>(p, instance);
  }
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_MOTION_BY(MakeInertial, "inertial",
                                 "a body with an inertial measurement unit",
                                 "[Sola2017] sec. 5.4; [Hartley2020] sec. 3.4"))
