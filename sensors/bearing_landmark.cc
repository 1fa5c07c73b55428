// SPDX-License-Identifier: Apache-2.0
#include "bearing_landmark.h"

#include "alidade/model/plugin.h"

namespace alidade {
namespace {

void Make(Params& p, AlidadeInstance* instance) {
  const int representation = p.Choice("landmarks.representation", {"inverse_depth", "xyz"},
                                      "representation of a landmark in the state", 0);
  if (representation == 0) {
    EmplaceSensor<BearingLandmark<PlanarInverseDepth>>(p, instance);
  } else {
    EmplaceSensor<BearingLandmark<PlanarXyz>>(p, instance);
  }
}

}  // namespace
}  // namespace alidade

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(alidade::Make, "bearing_landmark",
                                 "bearing of a landmark in the plane", "[Thrun2005] sec. 6.6"))
