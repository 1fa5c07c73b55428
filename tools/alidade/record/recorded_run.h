// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "alidade/base/timestamp.h"
#include "alidade/record/estimate_series.h"

/// Contents of the csv files of a run folder, for figures. Columns are identified by name.
namespace alidade::internal {

/// Element of a block in `NAME/estimates.csv`. Value and truth are ambient elements; sigma belongs
/// to a tangent element. Only elements of vectors and angles have both.
struct RecordedElement {
  std::string name;  ///< also the column of the value
  std::string unit;
  bool has_sigma = false;  ///< in column `sigma:NAME`
  std::string truth;       ///< column in truth.csv, or ""
  bool has_value = false;  ///< the element has a value at some timestamp
  bool varies = false;     ///< it has a value at some timestamp, and its block is not constant
  bool has_truth = false;
  bool is_random = false;  ///< its variance was above zero at some timestamp
};

/// Tangent element of a block. Column `sigma:NAME` of `NAME/estimates.csv` is its standard
/// deviation.
struct RecordedSigma {
  std::string name;
  std::string unit;
  bool is_random = false;  ///< its variance was above zero at some timestamp
};

/// Tangent element of the error of a block in `NAME/errors.csv`. Column `sigma:NAME` is its
/// standard deviation.
struct RecordedError {
  std::string name;
  std::string unit;
  int truth = 0, part = 0;  ///< index of the source's truth, and of its tangent element
  bool is_angle = false;    ///< an angle, or an element of a rotation or direction: rad
  bool is_known = false;    ///< the error is finite at some timestamp
  bool is_random = false;   ///< its variance was above zero at some timestamp
};

struct RecordedGain {
  std::string name;      ///< the column in `NAME/gains.csv`: `target.depth<-disparity`
  std::string unit;      ///< "" if it has no unit, or if the unit of the measurement is unknown
  std::size_t cell = 0;  ///< column index after time and sensor
  bool used = false;
};

struct RecordedSensor {
  std::string name;
  std::string stream;
  std::string unit;
  int tangent = 1;
  bool has_landmark = false;
  bool has_several = false;  ///< several measurements at a timestamp, as of landmarks or satellites
  std::vector<RecordedGain> gains;
  bool has_innovations = false;
  bool has_reprojection = false;  ///< rows in `NAME/reprojection.csv`
};

/// Numbers of landmarks in `NAME/landmarks.csv` with a position: all, those with a known true
/// position, and removed ones.
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
  int width = 0;  ///< size of the largest measurement: columns z0 .. z<width - 1>, then h, s and r
  int path = -1;  ///< first of the three elements of the position that sees landmarks; -1: none
  std::int64_t estimate_rows = 0, innovation_rows = 0, gain_rows = 0;
  std::int64_t reprojection_rows = 0;
  RecordedMap map = {};
};

struct RecordedStream {
  std::string name;
  int size = 1;
  std::int64_t rows = 0;
  std::int64_t expected_rows = 0;  ///< in expected.csv
};

/// Block whose value each measurement of a sensor implies, in `implied_states.csv`: from the
/// measurement alone, or with the true values of the sensor's other roles.
struct RecordedImplied {
  std::string sensor;
  std::string block;  ///< also the column
  std::string unit;
  bool rest_at_truth = false;  ///< the other roles have their true values
  std::size_t cell = 0;        ///< column index after time and sensor
  std::int64_t rows = 0;
};

/// Estimator with a column in `timing.csv`.
struct RecordedTimes {
  std::string estimator;  ///< also the column
  bool is_known = false;  ///< the time of some frame is known
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
