// SPDX-License-Identifier: Apache-2.0
#include "pseudorange_rate.h"

#include "alidade/model/plugin.h"

ALIDADE_PLUGIN(ALIDADE_SENSOR(alidade::PseudorangeRate, "pseudorange_rate",
                              "rate of the pseudorange to a transmitter, with clock drift",
                              "[Groves2013] sec. 9.4"))
