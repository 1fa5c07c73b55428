// SPDX-License-Identifier: Apache-2.0
#include "alidade/plugin.h"
#include "probe.h"

ALIDADE_PLUGIN(ALIDADE_SENSOR(Probe, "probe", "gain times x", ""))
