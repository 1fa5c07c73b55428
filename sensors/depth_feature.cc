// SPDX-License-Identifier: Apache-2.0
#include "depth_feature.h"

#include "alidade/model/plugin.h"

namespace {

void Make(alidade::Params& p, AlidadeInstance* instance) {
  alidade::WithRepresentation(alidade::ReadLandmarkRepresentation(p), [&](auto representation) {
    alidade::EmplaceSensor<alidade::DepthFeature<decltype(representation)>>(p, instance);
  });
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(Make, "depth_feature",
                                 "pixel and depth at which a depth camera observes a landmark",
                                 "[MonoSlam2015] sec. 2.1"))
