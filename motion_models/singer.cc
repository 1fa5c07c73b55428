// SPDX-License-Identifier: Apache-2.0
#include "singer.h"

#include "alidade/model/plugin.h"

namespace {

void MakeSinger(alidade::Params& p, AlidadeInstance* instance) {
  const int dimensions = p.Integer("dimensions", "number of axes", 1, 3, 1);
  if (dimensions == 1) alidade::EmplaceMotion<alidade::Singer<1>>(p, instance);
  if (dimensions == 2) alidade::EmplaceMotion<alidade::Singer<2>>(p, instance);
  if (dimensions == 3) alidade::EmplaceMotion<alidade::Singer<3>>(p, instance);
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_MOTION_BY(MakeSinger, "singer",
                                 "a point whose acceleration is a Gauss-Markov process",
                                 "[Singer1970]; [BarShalom2001] sec. 8.2"))
