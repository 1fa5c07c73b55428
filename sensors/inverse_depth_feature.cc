// SPDX-License-Identifier: Apache-2.0
#include "inverse_depth_feature.h"

#include "alidade/model/plugin.h"

namespace {

void Make(alidade::Params& p, AlidadeInstance* instance) {
  alidade::WithRepresentation(alidade::ReadLandmarkRepresentation(p), [&](auto representation) {
    alidade::EmplaceSensor<alidade::InverseDepthFeature<decltype(representation)>>(p, instance);
  });
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(Make, "inverse_depth_feature",
                                 "pixel at which one camera observes a landmark",
                                 "[MonoSlam2015] sec. 4.3, [Civera2008]"))
