// SPDX-License-Identifier: Apache-2.0
#include "constant.h"

#include "alidade/model/plugin.h"

ALIDADE_PLUGIN(ALIDADE_MOTION(alidade::Constant<>, "constant", "a constant value, or a random walk",
                              "[Ekf2017] sec. 1.2"))
