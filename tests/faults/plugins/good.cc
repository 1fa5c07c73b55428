// SPDX-License-Identifier: Apache-2.0
#include "alidade/model/plugin.h"
#include "probe.h"

ALIDADE_PLUGIN(ALIDADE_SENSOR(Probe, "probe", "gain times x", ""))
