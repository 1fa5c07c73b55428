// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdio>

#include "alidade/motion_models/constant_velocity.h"
#include "alidade/plugin/plugin_host.h"
#include "alidade/sensors/stereo_disparity.h"

// Returns 0 if a shipped model works as a plain struct and if the installed library finds its
// plugins.
int main() {
  const alidade::StereoDisparity stereo(400.0, 0.065, 1.0);
  const double depth_m = 0.5;
  double disparity_px = 0.0;
  if (!stereo.Predict(&depth_m, &disparity_px) || std::abs(disparity_px - 52.0) > 1e-12) return 1;

  const alidade::PluginHost host;
  for (const alidade::PluginEntry& entry : host.entries()) std::puts(entry.name.c_str());
  return host.entries().empty() || !host.refusals().empty() ? 1 : 0;
}
