// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/io/csv_file.h"
#include "alidade/record/contents.h"
#include "alidade/record/figure_script.h"

namespace alidade::internal {

/// `timing.csv`: the wall clock that each estimator needed for each frame, s. Those that smooth
/// have none, as most of their work is not of one frame.
class TimingFile {
 public:
  TimingFile(const OutputFolder& folder, const Experiment& experiment);

  /// The frame that the next times are of. Error: kIo.
  void Add(const SourceFrame& frame);
  void AddTime(int estimator, double wall_s);
  void Close();
  void Describe(RecordedRun& run) const;

 private:
  void EndRow();

  std::vector<RecordedTimes> times_;
  std::vector<int> column_of_;              ///< by estimator; -1: none
  std::vector<std::optional<double>> row_;  ///< by column
  Timestamp timestamp_ = kNoTimestamp;      ///< of the row
  CsvFile file_;
};

/// Figure `timing`: the wall clock of each frame over time, with the frame period; the key says
/// what share of real time that is. Empty where no time is known.
FigureScript TimingFigure(const RecordedRun& run);

}  // namespace alidade::internal
