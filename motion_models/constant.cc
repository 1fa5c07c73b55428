// SPDX-License-Identifier: Apache-2.0
#include "constant.h"

#include "alidade/model/plugin.h"

ALIDADE_PLUGIN(ALIDADE_MOTION(alidade::Constant<>, "constant",
                              "a value that stays, or a random walk", "[Ekf2017] sec. 1.2"))
