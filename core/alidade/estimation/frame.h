// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "alidade/base/timestamp.h"

namespace alidade {

/// Named stream of measurements, or of true values.
struct StreamInfo {
  std::string name;
  int size = 1;
  /// Standard deviation of each tangent element of a true value. Not used for measurements.
  double sigma = 0.0;
  int known = 0;       ///< number of known numbers of each measurement
  int covariance = 0;  ///< number of rows of the covariance of each measurement; 0: none
};

/// One value of one stream.
struct Measurement {
  Timestamp timestamp = 0;
  int stream = 0;  ///< index into the streams of the source
  std::int64_t landmark = -1;
  std::vector<double> values;
  /// R, row-major, which replaces the noise of the model. Empty: the noise of the model is used.
  std::vector<double> covariance;
  /// Inputs of the sensor model that are known exactly, such as the position of a satellite. Empty
  /// for most sensors.
  std::vector<double> known = {};
};

/// Measurements and control inputs of one timestamp, in the order of the source.
struct Frame {
  Timestamp timestamp = 0;
  std::vector<Measurement> measurements;
};

}  // namespace alidade
