// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/timing_file.h"

#include <algorithm>
#include <utility>

namespace alidade::internal {

TimingFile::TimingFile(const OutputFolder& folder, const Experiment& experiment,
                       RunColumns& run_columns) {
  for (const EstimatorSpec& spec : experiment.estimators) {
    const bool offline = spec.estimator->offline();
    column_of_.push_back(offline ? -1 : static_cast<int>(layout_.estimators.size()));
    if (!offline) layout_.estimators.push_back(spec.name);
  }
  row_.resize(layout_.estimators.size());
  std::vector<Column> columns;
  AppendColumns(kTimingColumns, layout_, columns);
  file_ = CreateCsv(folder, "timing.csv", std::move(columns), run_columns);
}

void TimingFile::Add(const SourceFrame& frame) {
  EndRow();
  timestamp_ = frame.timestamp;
}

void TimingFile::AddTime(int estimator, double wall_s) {
  const int column = column_of_.at(static_cast<std::size_t>(estimator));
  if (column < 0) return;
  row_[static_cast<std::size_t>(column)] = wall_s;
}

void TimingFile::EndRow() {
  const Timestamp timestamp =
      std::exchange(timestamp_, kNoTimestamp);  // the row is written once, even if this fails
  if (timestamp == kNoTimestamp) return;
  WriteCells(kTimingColumns, layout_, {timestamp, row_}, *file_);
  std::ranges::fill(row_, std::nullopt);
  file_->EndRow();
}

void TimingFile::Close() {
  EndRow();
  file_->Close();
}

}  // namespace alidade::internal
