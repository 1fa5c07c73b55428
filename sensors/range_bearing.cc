// SPDX-License-Identifier: Apache-2.0
#include "range_bearing.h"

#include "alidade/model/plugin.h"

namespace {

void Make(alidade::Params& p, AlidadeInstance* instance) {
  alidade::WithRepresentation(alidade::ReadLandmarkRepresentation(p), [&](auto representation) {
    alidade::EmplaceSensor<alidade::RangeBearing<decltype(representation)>>(p, instance);
  });
}

}  // namespace

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(Make, "range_bearing", "range and bearing of a landmark",
                                 "[Thrun2005] sec. 6.6"))
