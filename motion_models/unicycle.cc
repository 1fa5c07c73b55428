// SPDX-License-Identifier: Apache-2.0
#include "unicycle.h"

#include "alidade/model/plugin.h"

ALIDADE_PLUGIN(ALIDADE_MOTION(alidade::Unicycle, "unicycle",
                              "a vehicle in the plane with measured speed and turn rate",
                              "[Thrun2005] sec. 5.3"))
