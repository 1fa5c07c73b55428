// SPDX-License-Identifier: Apache-2.0
#include "bicycle.h"

#include "alidade/model/plugin.h"

ALIDADE_PLUGIN(ALIDADE_MOTION(alidade::Bicycle, "bicycle",
                              "a car in the plane with measured speed and steering angle",
                              "[Corke2017] sec. 4.1.1"))
