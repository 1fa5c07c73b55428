// SPDX-License-Identifier: Apache-2.0
#include "constant_velocity.h"

#include "alidade/model/plugin.h"

namespace {

template <bool kContinuous>
void Make(int dimensions, alidade::Params& p, AlidadeInstance* instance) {
  using alidade::ConstantVelocity;
  if (dimensions == 1) alidade::EmplaceMotion<ConstantVelocity<1, kContinuous>>(p, instance);
  if (dimensions == 2) alidade::EmplaceMotion<ConstantVelocity<2, kContinuous>>(p, instance);
  if (dimensions == 3) alidade::EmplaceMotion<ConstantVelocity<3, kContinuous>>(p, instance);
}

void MakeConstantVelocity(alidade::Params& p, AlidadeInstance* instance) {
  const int dimensions = p.Integer("dimensions", "number of axes", 1, 3, 1);
  const int kind =
      p.Choice("noise.kind", {"continuous", "discrete"},
               "white acceleration, or an acceleration that is constant between updates", 0);
  if (kind == 0) {
    Make<true>(dimensions, p, instance);
  } else {
    Make<false>(dimensions, p, instance);
  }
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_MOTION_BY(MakeConstantVelocity, "constant_velocity",
                                 "a point with constant velocity and a random acceleration",
                                 "[Ekf2017] sec. 4.1; [BarShalom2001] sec. 6"))
