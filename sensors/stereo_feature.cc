// SPDX-License-Identifier: Apache-2.0
#include "stereo_feature.h"

#include "alidade/model/plugin.h"

namespace {

void Make(alidade::Params& p, AlidadeInstance* instance) {
  alidade::WithRepresentation(alidade::ReadLandmarkRepresentation(p), [&](auto representation) {
    alidade::EmplaceSensor<alidade::StereoFeature<decltype(representation)>>(p, instance);
  });
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(Make, "stereo_feature",
                                 "pixels at which a rectified stereo pair observes a landmark",
                                 "[MonoSlam2015] sec. 2.2"))
