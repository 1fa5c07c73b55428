// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "alidade/base/timestamp.h"
#include "alidade/record/estimate_series.h"

/// What the csv files of a run folder hold, for those who draw them. Columns go by their names.
namespace alidade::internal {

/// One element of a block in `NAME/estimates.csv`. Value and truth are ambient elements, sigma is a
/// tangent one: next to a value only where both are the same, in vectors and angles.
struct RecordedElement {
  std::string name;  ///< the column of its value too
  std::string unit;
  bool has_sigma = false;  ///< in column `sigma:NAME`
  std::string truth;       ///< column in truth.csv, or ""
  bool has_value = false;  ///< at some timestamp
  bool varies = false;     ///< likewise, and its block was not constant
  bool has_truth = false;
  bool is_random = false;  ///< its variance was above zero at some timestamp
};

/// One tangent element of a block, whose standard deviation is in column `sigma:NAME` of
/// `NAME/estimates.csv`.
struct RecordedSigma {
  std::string name;
  std::string unit;
  bool is_random = false;  ///< its variance was above zero at some timestamp
};

/// One element of the error of a block in `NAME/errors.csv`, a tangent one; sigma in column
/// `sigma:NAME`.
struct RecordedError {
  std::string name;
  std::string unit;
  int truth = 0, part = 0;  ///< of the source's truths, and the tangent element of it
  bool is_angle = false;    ///< or of a rotation or direction: rad
  bool is_known = false;    ///< finite at some timestamp
  bool is_random = false;   ///< its variance was above zero at some timestamp
};

struct RecordedGain {
  std::string name;      ///< the column in `NAME/gains.csv`: `target.depth<-disparity`
  std::string unit;      ///< "" where it has none, or that of the measurement is not known
  std::size_t cell = 0;  ///< of a row, behind time and sensor
  bool used = false;
};

struct RecordedSensor {
  std::string name;
  std::string stream;
  std::string unit;
  int tangent = 1;
  bool has_landmark = false;
  bool has_several = false;  ///< measurements at one timestamp: of landmarks, of satellites
  std::vector<RecordedGain> gains;
  bool has_innovations = false;
  bool has_reprojection = false;  ///< rows in `NAME/reprojection.csv`
};

/// Landmarks of `NAME/landmarks.csv` that have a place: all, those of them whose true one is known
/// too, and those that were removed.
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
  int width = 0;  ///< of the widest measurement: columns z0 .. z<width - 1>, then h, s and r
  int path = -1;  ///< the first of the three elements that landmarks are seen from; -1: none
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

/// A block whose value each measurement of a sensor implies, in `implied_states.csv`: by itself, or
/// with the sensor's other roles at truth.
struct RecordedImplied {
  std::string sensor;
  std::string block;  ///< the column too
  std::string unit;
  bool rest_at_truth = false;
  std::size_t cell = 0;  ///< of a row, behind time and sensor
  std::int64_t rows = 0;
};

/// An estimator with a column in `timing.csv`.
struct RecordedTimes {
  std::string estimator;  ///< the column
  bool is_known = false;  ///< of some frame
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
