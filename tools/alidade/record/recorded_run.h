// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "alidade/diagnosis/innovation_series.h"
#include "alidade/record/estimate_series.h"

/// Description of the files of an estimator, for run.json.
namespace alidade::internal {

/// Sensor of an estimator.
struct RecordedSensor {
  std::string name;
  std::string stream;
  std::string unit;
  int tangent = 1;
  InnovationSeries series;        ///< description of the innovations, without measurements
  bool has_reprojection = false;  ///< true: the sensor has rows in `NAME/reprojection.csv`
  /// Column of `NAME/gains.csv` of each gain of the sensor, as an index after the columns of time
  /// and sensor. Order: block, element of the block, measured element.
  std::vector<std::size_t> gain_columns;
};

struct RecordedEstimator {
  std::string name;
  std::vector<SeriesBlock> blocks = {};
  std::vector<RecordedSensor> sensors = {};
  std::int64_t rows = 0;  ///< rows of `NAME/estimates.csv`
};

}  // namespace alidade::internal
