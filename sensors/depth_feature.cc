// SPDX-License-Identifier: Apache-2.0
#include "depth_feature.h"

#include "alidade/model/plugin.h"

namespace {

void Make(alidade::Params& p, AlidadeInstance* instance) {
  alidade::WithForm(alidade::ReadLandmarkForm(p), [&](auto form) {
    alidade::EmplaceSensor<alidade::DepthFeature<decltype(form)>>(p, instance);
  });
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(Make, "depth_feature",
                                 "pixel and depth at which a depth camera sees a landmark",
                                 "[MonoSlam2015] sec. 2.1"))
