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

/// Writer of the source's data: `measurements.csv`; `truth.csv` if there are truths;
/// `expected.csv` if the truths determine a sensor's measurement; `implied_states.csv` if a sensor
/// can be inverted from the measurement alone or with the truth of its other roles.
class SourceFiles {
 public:
  SourceFiles(const OutputFolder& folder, const Experiment& experiment, RunColumns& run_columns);

  /// Error: kIo.
  void Add(const SourceFrame& frame);
  void Close();
  const TruthLayout& truth_layout() const { return truth_layout_; }
  /// Fills the fields of `run` that describe the source's data.
  void Describe(RecordedRun& run) const;

 private:
  struct Inverse {
    int stream;
    ImpliedState state;
    RecordedImplied recorded;
  };
  /// First sensor of a stream whose roles all have a truth.
  struct Expectation {
    SharedSensor model;
    std::vector<int> truths;
  };

  void FindInverses(const Experiment& experiment);
  void AddExpected(const SourceFrame& frame, const Measurement& measurement);
  void AddImplied(const SourceFrame& frame, const Measurement& measurement);

  std::vector<StreamInfo> streams_;
  TruthLayout truth_layout_;
  std::vector<std::int64_t> stream_rows_;    ///< rows in measurements.csv, by stream
  std::vector<std::int64_t> expected_rows_;  ///< rows in expected.csv, by stream
  std::map<int, Expectation> expectations_;  ///< by stream
  std::vector<Inverse> inverses_;
  MeasurementLayout layout_{1, 0};
  ImpliedLayout implied_layout_;
  Timestamp first_ = kNoTimestamp, last_ = kNoTimestamp;
  std::optional<CsvFile> measurements_, truth_, expected_, implied_;
  std::optional<PoseFile> poses_;
};

}  // namespace alidade::internal
