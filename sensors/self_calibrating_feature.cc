// SPDX-License-Identifier: Apache-2.0
#include "self_calibrating_feature.h"

#include "alidade/model/plugin.h"

namespace {

void Make(alidade::Params& p, AlidadeInstance* instance) {
  using alidade::SelfCalibratingFeature;
  if (p.Choice("lens", {"radial", "radtan"}, "lens model, which determines the intrinsics", 0) ==
      1) {
    alidade::EmplaceSensor<SelfCalibratingFeature<alidade::RadtanLens>>(p, instance);
  } else {
    alidade::EmplaceSensor<SelfCalibratingFeature<alidade::RadialLens>>(p, instance);
  }
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(Make, "self_calibrating_feature",
                                 "pixel at which a camera with unknown intrinsics observes a point",
                                 "[Agarwal2010]"))
