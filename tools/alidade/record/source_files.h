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

namespace alidade::internal {

/// Writer of the files with the data of the source:
///
///   measurements.csv     always
///   truth.csv            if the source provides true values
///   expected.csv         if the true values determine the prediction of a sensor
///   implied_states.csv   if a measurement determines the value of a block, alone or together with
///                        the true values of the other roles
class SourceFiles {
 public:
  SourceFiles(const OutputFolder& folder, const Experiment& experiment, RunColumns& run_columns);

  /// Writes the rows of a frame. Error: kIo.
  void Add(const SourceFrame& frame);
  void Close();
  const TruthLayout& truth_layout() const { return truth_layout_; }

 private:
  struct Inverse {
    int stream;
    ImpliedState state;
    std::string sensor;
    std::size_t column;  ///< index into implied_layout_.blocks
  };
  /// Model of a sensor whose roles all have a truth; the first such sensor of its stream. `truths`
  /// contains the index of the truth of each role.
  struct Expectation {
    SharedSensor model;
    std::vector<int> truths;
  };

  void FindInverses(const Experiment& experiment);
  /// Returns the column of a block in implied_states.csv. Adds the column if it does not exist.
  std::size_t AddImpliedColumn(const Problem& problem, BlockId id);
  /// Returns the name of the stream of a measurement.
  const std::string& StreamOf(const Measurement& measurement) const;
  void AddExpected(const SourceFrame& frame, const Measurement& measurement);
  void AddImplied(const SourceFrame& frame, const Measurement& measurement);

  std::vector<StreamInfo> streams_;
  TruthLayout truth_layout_;
  std::map<int, Expectation> expectations_;  ///< key: index of the stream
  std::vector<Inverse> inverses_;
  MeasurementLayout layout_{1, 0, 0};
  ImpliedLayout implied_layout_;
  std::optional<CsvFile> measurements_, truth_, expected_, implied_;
  std::optional<PoseFile> poses_;
};

}  // namespace alidade::internal
