// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "alidade/base/timestamp.h"

namespace alidade {

/// A named stream of measurements, or of true values.
struct StreamInfo {
  std::string name;
  int size = 1;
  double sigma = 0.0;  ///< of a truth: standard deviation of each element, in its tangent
  int known = 0;       ///< known numbers that come with each measurement
};

/// One value of one stream.
struct Measurement {
  Timestamp timestamp = 0;
  int stream = 0;  ///< index into the streams of the source
  std::int64_t landmark = -1;
  std::vector<double> values;
  std::vector<double> covariance;  ///< row-major, overrides the model's noise; empty: none
  /// What its sensor takes as known with it: where the satellite was. Mostly empty.
  std::vector<double> known = {};
};

/// What was measured at one timestamp, in the order of the source: all that an estimator sees.
struct Frame {
  Timestamp timestamp = 0;
  std::vector<Measurement> measurements;
};

}  // namespace alidade
