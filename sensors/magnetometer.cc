// SPDX-License-Identifier: Apache-2.0
#include "magnetometer.h"

#include "alidade/model/plugin.h"

ALIDADE_PLUGIN(ALIDADE_SENSOR(alidade::Magnetometer, "magnetometer",
                              "magnetic field of the Earth, measured on a body",
                              "[Groves2013] sec. 6.1.1"))
