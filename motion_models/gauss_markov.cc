// SPDX-License-Identifier: Apache-2.0
#include "gauss_markov.h"

#include "alidade/model/plugin.h"

ALIDADE_PLUGIN(ALIDADE_MOTION(alidade::GaussMarkov<>, "gauss_markov",
                              "a value that returns to 0, such as a slowly varying bias",
                              "[BarShalom2001] sec. 8.2"))
