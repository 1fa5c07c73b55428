// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "alidade/source.h"

/// What the csv files of a run folder hold and where, for those who draw them. Columns count from
/// 1; 0 where there is none.
namespace alidade::internal {

/// One element of a block in `NAME/estimates.csv`. Value and truth are ambient elements, sigma is a
/// tangent one: beside a value only where both are the same, in vectors and angles.
struct RecordedElement {
  std::string name;
  std::string unit;
  int value = 0;
  int sigma = 0;
  int truth = 0;           ///< in truth.csv
  bool has_value = false;  ///< at some stamp
  bool has_truth = false;
  bool is_random = false;  ///< its variance was above zero at some stamp
};

struct RecordedGain {
  std::string name;  ///< `target.depth<-disparity`
  int column = 0;    ///< in `NAME/gains.csv`
  bool used = false;
};

struct RecordedSensor {
  std::string name;
  std::string stream;
  std::string unit;
  int tangent = 1;
  std::vector<RecordedGain> gains;
  bool has_innovations = false;
};

struct RecordedEstimator {
  std::string name;
  std::vector<RecordedElement> elements;
  std::vector<RecordedSensor> sensors;
  int width = 0;  ///< of the widest measurement: columns z0 .. z<width - 1>, then h, s and r
  std::int64_t estimate_rows = 0, innovation_rows = 0, gain_rows = 0;

  int h_column(int i) const { return 8 + width + i; }
  int s_column(int i) const { return 8 + 2 * width + i; }
  int r_column(int i) const { return 8 + 3 * width + i; }
};

struct RecordedStream {
  std::string name;
  int size = 1;
  std::int64_t rows = 0;
};

/// A block whose value each measurement of a sensor implies by itself, in `implied.csv`.
struct RecordedImplied {
  std::string sensor;
  std::string block;
  std::string unit;
  int column = 0;
  std::int64_t rows = 0;
};

struct RecordedRun {
  std::vector<RecordedEstimator> estimators;
  std::vector<RecordedStream> streams;
  std::vector<RecordedImplied> implied;
  Stamp first = 0, last = 0;
  std::int64_t truth_rows = 0, measurement_rows = 0, implied_rows = 0;
};

}  // namespace alidade::internal
