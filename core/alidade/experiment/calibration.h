// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/config/config.h"
#include "alidade/experiment/source.h"

namespace alidade::internal {

/// The config with the calibration that the data of its source bring, below the root key
/// `calibration`, where models find it (ParamReader); the config itself where they bring none, or
/// where `source.calibration` is `ignore`. Errors: kBadConfig, those of Source::Calibration.
Config WithCalibration(const Config& config, const Source& source);

}  // namespace alidade::internal
