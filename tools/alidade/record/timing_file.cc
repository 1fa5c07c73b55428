// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/timing_file.h"

#include <algorithm>
#include <utility>

#include "alidade/base/number_text.h"

namespace alidade::internal {
TimingFile::TimingFile(const OutputFolder& folder, const Experiment& experiment,
                       RunColumns& run_columns) {
  for (const EstimatorSpec& spec : experiment.estimators) {
    const bool offline = spec.estimator->offline();
    column_of_.push_back(offline ? -1 : static_cast<int>(times_.size()));
    if (offline) continue;
    times_.push_back({spec.name});
    layout_.estimators.push_back(spec.name);
  }
  row_.resize(times_.size());
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
  times_[static_cast<std::size_t>(column)].is_known = true;
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

void TimingFile::Describe(RecordedRun& run) const {
  run.times = times_;
  run.timing_rows = file_->rows();
}

FigureScript TimingFigure(const RecordedRun& run) {
  FigureScript script("timing", "wall-clock time of each frame", run.first, run.last);
  const double span_s = Seconds(run.last) - Seconds(run.first);
  if (run.timing_rows < 2 || !(span_s > 0.0)) return script;
  const FigureFile file{"timing.csv", run.timing_rows};
  std::size_t style = 0;
  for (const RecordedTimes& times : run.times) {
    if (!times.is_known || style == kMaxCurves) continue;
    if (style++ == 0) {
      script.Panel("wall-clock time of a frame", "[ms]");
      script.Set("period = " + NumberText(span_s / static_cast<double>(run.timing_rows - 1)));
      script.Set("set logscale y\nset format y '%g'\nunset mytics");
    }
    const std::string column = GnuplotColumn(times.estimator);
    const std::string name = "C" + std::to_string(style);
    script.Quartiles(name, file.name, column);
    script.CurveWithKey(
        file,
        FigureScript::kTime + ("(1e3 * " + column + ") with lines ls ") + std::to_string(style),
        "sprintf('%s: %.2g %% of real time', " + GnuplotQuoted(times.estimator) + ", 100 * " +
            name + "_sum / (" + name + "_records * period))",
        times.estimator.size() + sizeof ": 0.12 % of real time");
  }
  if (style > 0) {
    script.Curve(file, FigureScript::kTime + std::string("(1e3 * period) with lines ls 11"),
                 "frame period");
  }
  return script;
}

}  // namespace alidade::internal
