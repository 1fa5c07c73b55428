// SPDX-License-Identifier: Apache-2.0
#include "self_calibrating_feature.h"

#include "alidade/model/plugin.h"

namespace {

void Make(alidade::Params& p, AlidadeInstance* instance) {
  using alidade::SelfCalibratingFeature;
  switch (p.Choice("lens", {"radial", "radtan", "opencv"},
                   "lens model, which determines the intrinsics", 0)) {
    case 1:
      return alidade::EmplaceSensor<SelfCalibratingFeature<alidade::RadtanLens>>(p, instance);
    case 2:
      return alidade::EmplaceSensor<SelfCalibratingFeature<alidade::OpenCvLens>>(p, instance);
    default:
      return alidade::EmplaceSensor<SelfCalibratingFeature<alidade::RadialLens>>(p, instance);
  }
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(Make, "self_calibrating_feature",
                                 "pixel at which a camera with unknown intrinsics observes a point",
                                 "[Agarwal2010]"))
