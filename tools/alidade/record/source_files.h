// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "alidade/experiment/implied_state.h"
#include "alidade/experiment/run.h"
#include "alidade/io/csv_file.h"
#include "alidade/record/column_tables.h"
#include "alidade/record/pose_file.h"
#include "alidade/record/recorded_run.h"

namespace alidade::internal {

/// Writer of the data of the source:
///
///   measurements.csv     always
///   truth.csv            if there are truths
///   expected.csv         if the truths determine the measurement of a sensor
///   implied_states.csv   if a sensor can be inverted, from the measurement alone or with the truth
///                        of the other roles
class SourceFiles {
 public:
  SourceFiles(const OutputFolder& folder, const Experiment& experiment, RunColumns& run_columns);

  /// Writes the rows of a frame. Error: kIo.
  void Add(const SourceFrame& frame);
  void Close();
  const TruthLayout& truth_layout() const { return truth_layout_; }
  /// Sets the fields of `run` that describe the data of the source.
  void Describe(RecordedRun& run) const;

 private:
  struct Inverse {
    int stream;
    ImpliedState state;
    RecordedImplied recorded;
  };
  /// Model of the first sensor of a stream for which all roles have a truth.
  struct Expectation {
    SharedSensor model;
    std::vector<int> truths;
  };

  void FindInverses(const Experiment& experiment);
  void AddExpected(const SourceFrame& frame, const Measurement& measurement);
  void AddImplied(const SourceFrame& frame, const Measurement& measurement);

  std::vector<StreamInfo> streams_;
  TruthLayout truth_layout_;
  std::vector<std::int64_t> stream_rows_;    ///< rows of each stream in measurements.csv
  std::vector<std::int64_t> expected_rows_;  ///< rows of each stream in expected.csv
  std::map<int, Expectation> expectations_;  ///< key: index of the stream
  std::vector<Inverse> inverses_;
  MeasurementLayout layout_{1, 0};
  ImpliedLayout implied_layout_;
  Timestamp first_ = kNoTimestamp, last_ = kNoTimestamp;
  std::optional<CsvFile> measurements_, truth_, expected_, implied_;
  std::optional<PoseFile> poses_;
};

}  // namespace alidade::internal
