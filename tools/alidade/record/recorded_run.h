// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "alidade/base/timestamp.h"
#include "alidade/experiment/innovation_series.h"
#include "alidade/record/estimate_series.h"

/// Description of the csv files of a run folder, for figures. Columns are identified by name.
namespace alidade::internal {

/// Element of a block in `NAME/estimates.csv`. Value and truth are those of an ambient element.
/// Sigma is that of a tangent element. For vectors and angles, the ambient and the tangent elements
/// are the same.
struct RecordedElement {
  std::string name;  ///< name of the element, and of the column with its value
  std::string unit;
  bool has_sigma = false;  ///< true: column `sigma:NAME` exists
  std::string truth;       ///< name of the column in truth.csv; "": none
  bool has_value = false;  ///< true: the element has a value at some timestamp
  bool varies = false;     ///< true: has_value, and the block is not constant
  bool has_truth = false;
  bool is_random = false;  ///< true: the variance is above zero at some timestamp
};

/// Tangent element of a block. Column `sigma:NAME` of `NAME/estimates.csv` contains the
/// standard deviation.
struct RecordedSigma {
  std::string name;
  std::string unit;
  bool is_random = false;  ///< true: the variance is above zero at some timestamp
};

/// Tangent element of the error of a block in `NAME/errors.csv`. Column `sigma:NAME` contains the
/// standard deviation.
struct RecordedError {
  std::string name;
  std::string unit;
  /// `truth` is an index into Source::truths(). `part` is the index of the tangent element.
  int truth = 0, part = 0;
  bool is_angle = false;   ///< true: an element of an angle, rotation or direction, in rad
  bool is_known = false;   ///< true: the error is finite at some timestamp
  bool is_random = false;  ///< true: the variance is above zero at some timestamp
};

struct RecordedGain {
  std::string name;      ///< column in `NAME/gains.csv`, such as `target.depth<-disparity`
  std::string unit;      ///< "": the gain has no unit, or an unknown unit
  std::size_t cell = 0;  ///< index of the column after the columns of time and sensor
  bool used = false;
};

struct RecordedSensor {
  std::string name;
  std::string stream;
  std::string unit;
  int tangent = 1;
  InnovationSeries series;  ///< description of the innovations, without measurements
  bool has_landmark = false;
  bool has_several = false;  ///< true: a timestamp can have several measurements
  std::vector<RecordedGain> gains;
  bool has_innovations = false;
  bool has_reprojection = false;  ///< true: the sensor has rows in `NAME/reprojection.csv`
};

/// Numbers of landmarks that have a position in `NAME/landmarks.csv`: `placed` counts all of these
/// landmarks, `known` those with a known true position, and `removed` those that were removed.
struct RecordedMap {
  std::int64_t placed = 0, known = 0, removed = 0;
};

struct RecordedEstimator {
  std::string name;
  std::vector<SeriesBlock> blocks = {};
  std::vector<RecordedElement> elements = {};
  std::vector<RecordedSigma> sigmas = {};
  std::vector<RecordedError> errors = {};
  std::vector<RecordedSensor> sensors = {};
  int width = 0;  ///< number of columns of each of z, h, s and r
  int path = -1;  ///< index of the first element of the camera position; -1: no position
  std::int64_t estimate_rows = 0, innovation_rows = 0, gain_rows = 0;
  std::int64_t reprojection_rows = 0;
  RecordedMap map = {};
};

struct RecordedStream {
  std::string name;
  int size = 1;
  std::int64_t rows = 0;
  std::int64_t expected_rows = 0;  ///< rows in expected.csv
};

/// Block in `implied_states.csv`. A measurement of the sensor determines the value of this block,
/// alone or together with the true values of the other roles.
struct RecordedImplied {
  std::string sensor;
  std::string block;  ///< name of the block and of the column
  std::string unit;
  bool rest_at_truth = false;  ///< true: the other roles have their true values
  std::size_t cell = 0;        ///< index of the column after the columns of time and sensor
  std::int64_t rows = 0;
};

/// Estimator with a column in `timing.csv`.
struct RecordedTimes {
  std::string estimator;  ///< name of the estimator and of the column
  bool is_known = false;  ///< true: the time of some frame is known
};

struct RecordedRun {
  std::vector<RecordedEstimator> estimators;
  std::vector<RecordedStream> streams;
  std::vector<RecordedImplied> implied;
  std::vector<RecordedTimes> times;
  Timestamp first = 0, last = 0;
  std::int64_t truth_rows = 0, measurement_rows = 0, implied_rows = 0, expected_rows = 0;
  std::int64_t timing_rows = 0;
};

}  // namespace alidade::internal
