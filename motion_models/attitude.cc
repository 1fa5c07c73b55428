// SPDX-License-Identifier: Apache-2.0
#include "attitude.h"

#include "alidade/model/plugin.h"

ALIDADE_PLUGIN(ALIDADE_MOTION(alidade::Attitude, "attitude",
                              "the orientation of a body with a gyroscope",
                              "[Sola2017] sec. 4.6, 5.1"))
