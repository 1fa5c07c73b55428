// SPDX-License-Identifier: Apache-2.0
#include "scale_2d.h"

#include "alidade/model/plugin.h"

ALIDADE_PLUGIN(ALIDADE_SENSOR(alidade::Scale2d, "scale_2d",
                              "inverse apparent size of a target: 1/scale = lambda Z",
                              "[Ekf2017] sec. 1.2, 4"))
