// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/config.h"

namespace alidade {

/// What a Source is besides, if its data tell how the camera is calibrated that took them.
class CalibratedData {
 public:
  virtual ~CalibratedData() = default;
  /// A config of the one map `calibration`, with parameters under the keys by which models ask for
  /// them: `calibration: {camera: {fx: 721.5}, baseline_m: 0.54}`. Empty: the data tell nothing.
  /// Errors: kBadData, kInputMissing.
  virtual Config Calibration() const = 0;
};

}  // namespace alidade
