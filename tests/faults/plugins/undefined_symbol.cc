// SPDX-License-Identifier: Apache-2.0
#include "alidade/model/plugin.h"
#include "probe.h"

extern "C" double a_function_nobody_defines(double);

struct Undefined : Probe {
  using Probe::Probe;
  bool Valid(const double* z) const { return a_function_nobody_defines(z[0]) > 0.0; }
};

ALIDADE_PLUGIN(ALIDADE_SENSOR(Undefined, "undefined", "", ""))
