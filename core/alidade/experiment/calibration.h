// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/config/config.h"
#include "alidade/experiment/source.h"

namespace alidade::internal {

/// Returns a copy of the config in which each `camera: {file, entry, ...}` is replaced by the keys
/// of that calibration file (ReadCalibrationFile). `camera` is a key of the root or of a sensor.
/// Other keys of the map take precedence over those of the file. A relative path refers to the
/// folder of the file that contains the key. Errors: kBadData, kInputMissing.
Config WithCameraFiles(const Config& config);

/// Returns a copy of the config that also contains the calibration of the data, under the root key
/// `calibration`. Models read the calibration from this key (ParamReader). Returns `config`
/// unchanged if the data have no calibration, or if `source.calibration` is `ignore`. Errors:
/// kBadConfig, and those of Source::Calibration.
Config WithCalibration(const Config& config, const Source& source);
/// Returns a copy of the config without the calibration of the data.
Config WithoutCalibration(const Config& config);

}  // namespace alidade::internal
