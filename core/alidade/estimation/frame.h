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
  double sigma = 0.0;  ///< of true values: standard deviation of each element, in the tangent space
  int known = 0;       ///< number of known numbers of each measurement
};

/// One value of one stream.
struct Measurement {
  Timestamp timestamp = 0;
  int stream = 0;  ///< index into the streams of the source
  std::int64_t landmark = -1;
  std::vector<double> values;
  std::vector<double> covariance;  ///< row-major, overrides the model's noise; empty: the model's
  /// Inputs of the sensor model that are known exactly, such as the position of a satellite. Mostly
  /// empty.
  std::vector<double> known = {};
};

/// Measurements of one timestamp, in the order of the source. The only input of an estimator.
struct Frame {
  Timestamp timestamp = 0;
  std::vector<Measurement> measurements;
};

}  // namespace alidade
