// SPDX-License-Identifier: Apache-2.0
#include "bearing_landmark.h"

#include "alidade/model/plugin.h"

ALIDADE_PLUGIN(ALIDADE_SENSOR(alidade::BearingLandmark, "bearing_landmark",
                              "bearing of a landmark in the plane", "[Thrun2005] sec. 6.6"))
