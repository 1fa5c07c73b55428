// SPDX-License-Identifier: Apache-2.0
#include "pose.h"

#include "alidade/model/plugin.h"

ALIDADE_PLUGIN(ALIDADE_SENSOR(alidade::Pose, "pose",
                              "position and orientation with a joint covariance",
                              "[Sola2017] ch. 4"))
