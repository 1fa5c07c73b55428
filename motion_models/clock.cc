// SPDX-License-Identifier: Apache-2.0
#include "clock.h"

#include "alidade/model/plugin.h"

namespace {

void MakeClock(alidade::Params& p, AlidadeInstance* instance) {
  const int unit =
      p.Choice("unit", {"m", "s"}, "unit of the bias: times the speed of light, or s", 0);
  if (unit == 0) {
    alidade::EmplaceMotion<alidade::Clock<true>>(p, instance);
  } else {
    alidade::EmplaceMotion<alidade::Clock<false>>(p, instance);
  }
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_MOTION_BY(MakeClock, "clock", "bias and drift of the clock of a receiver",
                                 "[Brown2012] sec. 9.3"))
