// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/config/config.h"
#include "alidade/experiment/source.h"

namespace alidade::internal {

/// Returns the config with the calibration of the data below the root key `calibration`, from which
/// models read it (ParamReader). Returns the config itself if the data have no calibration, or if
/// `source.calibration` is `ignore`. Errors: kBadConfig, those of Source::Calibration.
Config WithCalibration(const Config& config, const Source& source);

}  // namespace alidade::internal
