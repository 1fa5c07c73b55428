// SPDX-License-Identifier: Apache-2.0
#include "specific_force.h"

#include "alidade/model/plugin.h"

ALIDADE_PLUGIN(ALIDADE_SENSOR(alidade::SpecificForce, "specific_force",
                              "accelerometer of a body that stands or turns",
                              "[Groves2013] sec. 5.6.1"))
