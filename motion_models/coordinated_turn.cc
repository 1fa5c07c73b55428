// SPDX-License-Identifier: Apache-2.0
#include "coordinated_turn.h"

#include "alidade/model/plugin.h"

ALIDADE_PLUGIN(ALIDADE_MOTION(alidade::CoordinatedTurn, "coordinated_turn",
                              "a target in the plane with nearly constant speed and turn rate",
                              "[BarShalom2001] sec. 11.7"))
