// SPDX-License-Identifier: Apache-2.0
#include "constant_velocity.h"

#include "alidade/plugin.h"

namespace {

template <bool kWhite>
void Make(int dimensions, alidade::Params& p, AlidadeInstance* instance) {
  using alidade::ConstantVelocity;
  if (dimensions == 1) alidade::EmplaceMotion<ConstantVelocity<1, kWhite>>(p, instance);
  if (dimensions == 2) alidade::EmplaceMotion<ConstantVelocity<2, kWhite>>(p, instance);
  if (dimensions == 3) alidade::EmplaceMotion<ConstantVelocity<3, kWhite>>(p, instance);
}

void MakeConstantVelocity(alidade::Params& p, AlidadeInstance* instance) {
  const int dimensions = p.Integer("dimensions", "number of axes", 1, 3, 1);
  const int kind = p.Choice("noise.kind", {"piecewise_constant", "white"},
                            "acceleration constant during a step, or continuous and white", 0);
  if (kind == 1) {
    Make<true>(dimensions, p, instance);
  } else {
    Make<false>(dimensions, p, instance);
  }
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_MOTION_BY(MakeConstantVelocity, "constant_velocity",
                                 "a point with constant velocity but for a random acceleration",
                                 "[Ekf2017] sec. 4.1; [BarShalom2001] sec. 6"))
