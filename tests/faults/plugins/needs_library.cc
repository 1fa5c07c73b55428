// SPDX-License-Identifier: Apache-2.0
// Without a fault, but for where it looks for the library that it needs.
extern "C" int needed();
#define PROBE_GAIN static_cast<double>(needed())
#include "alidade/model/plugin.h"
#include "probe.h"

ALIDADE_PLUGIN(ALIDADE_SENSOR(Probe, "probe", "", ""))
