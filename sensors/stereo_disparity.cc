// SPDX-License-Identifier: Apache-2.0
#include "stereo_disparity.h"

#include "alidade/model/plugin.h"

ALIDADE_PLUGIN(ALIDADE_SENSOR(alidade::StereoDisparity, "stereo_disparity",
                              "disparity of one point in a rectified stereo pair: d = f B / Z",
                              "[Ekf2017] sec. 1.2"))
