// SPDX-License-Identifier: Apache-2.0
#include "pseudorange.h"

#include "alidade/model/plugin.h"

ALIDADE_PLUGIN(
    ALIDADE_SENSOR(alidade::Pseudorange, "pseudorange",
                   "distance to a transmitter at a known position plus clock bias of the receiver",
                   "[Groves2013] sec. 9.4"))
