// SPDX-License-Identifier: Apache-2.0
#include "differential_drive.h"

#include "alidade/model/plugin.h"

ALIDADE_PLUGIN(ALIDADE_MOTION(alidade::DifferentialDrive, "differential_drive",
                              "a robot in the plane with measured speeds of its two wheels",
                              "[Siegwart2011] sec. 3.2; [Borenstein1996]"))
