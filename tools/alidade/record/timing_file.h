// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/io/csv_file.h"
#include "alidade/record/column_tables.h"

namespace alidade::internal {

/// Writer of `timing.csv`: the wall-clock time of each estimator for each frame, s. Offline
/// estimators are omitted, because most of their work does not belong to a single frame.
class TimingFile {
 public:
  TimingFile(const OutputFolder& folder, const Experiment& experiment, RunColumns& run_columns);

  /// Starts the row of a frame. Subsequent times belong to this frame. Error: kIo.
  void Add(const SourceFrame& frame);
  void AddTime(int estimator, double wall_s);
  void Close();

 private:
  void EndRow();

  std::vector<int> column_of_;              ///< column of each estimator; -1: offline
  std::vector<std::optional<double>> row_;  ///< time in each column
  Timestamp timestamp_ = kNoTimestamp;      ///< timestamp of the current row
  TimingLayout layout_;
  std::optional<CsvFile> file_;
};

}  // namespace alidade::internal
