// SPDX-License-Identifier: Apache-2.0
#include "known_pixel.h"

#include "alidade/model/fixed_known.h"

ALIDADE_PLUGIN(ALIDADE_SENSOR_BY(alidade::EmplaceKnown<alidade::KnownPixel>, "known_pixel",
                                 "pixel of a known point, seen by a camera on a body",
                                 "[Brown1971]"))
