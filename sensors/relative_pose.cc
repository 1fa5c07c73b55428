// SPDX-License-Identifier: Apache-2.0
#include "relative_pose.h"

#include "alidade/model/plugin.h"

ALIDADE_PLUGIN(ALIDADE_SENSOR(alidade::RelativePose, "relative_pose",
                              "pose of a landmark relative to the body: a tag, or a keyframe",
                              "[Roumeliotis2002]"))
