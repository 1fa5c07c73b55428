// SPDX-License-Identifier: Apache-2.0
#include "constant_acceleration.h"

#include "alidade/model/plugin.h"

namespace {

template <bool kContinuous>
void Make(int dimensions, alidade::Params& p, AlidadeInstance* instance) {
  using alidade::ConstantAcceleration;
  if (dimensions == 1) alidade::EmplaceMotion<ConstantAcceleration<1, kContinuous>>(p, instance);
  if (dimensions == 2) alidade::EmplaceMotion<ConstantAcceleration<2, kContinuous>>(p, instance);
  if (dimensions == 3) alidade::EmplaceMotion<ConstantAcceleration<3, kContinuous>>(p, instance);
}

void MakeConstantAcceleration(alidade::Params& p, AlidadeInstance* instance) {
  const int dimensions = p.Integer("dimensions", "number of axes", 1, 3, 1);
  const int kind = p.Choice("noise.kind", {"continuous", "discrete"},
                            "white jerk, or a jerk that is constant between updates", 0);
  if (kind == 0) {
    Make<true>(dimensions, p, instance);
  } else {
    Make<false>(dimensions, p, instance);
  }
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_MOTION_BY(MakeConstantAcceleration, "constant_acceleration",
                                 "a point with constant acceleration and a random jerk",
                                 "[BarShalom2001] sec. 6.2.3"))
