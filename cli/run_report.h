// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/report/conclusion.h"

namespace alidade::cli {

/// Text about a finished run for a terminal. It observes the run to determine the duration of the
/// data.
class RunReport : public RunObserver {
 public:
  /// `width` is the width of lines.
  explicit RunReport(std::size_t width) : width_(width) {}

  void Begin(const Experiment& experiment) override;
  void OnFrame(const SourceFrame& frame) override;

  /// Returns a head line, the verdicts, the first warnings and conclusions, and a table, at most 23
  /// lines in all. The config or their relevance selects the rows of the table. If `all_rows` is
  /// true, the table is complete.
  std::string Short(const RunResult& result, const std::vector<internal::Conclusion>& conclusions,
                    bool all_rows) const;
  /// Returns the same with the findings, the conclusions and the events, without a limit.
  std::string Verbose(const RunResult& result, const std::vector<internal::Conclusion>& conclusions,
                      bool all_rows) const;

 private:
  std::string Head(const RunResult& result) const;
  std::string Table(const RunResult& result, bool all_rows, std::size_t max_lines) const;

  std::size_t width_;
  std::uint64_t seed_ = 1;
  std::vector<std::string> subjects_, rows_;
  Timestamp first_ = kNoTimestamp, last_ = kNoTimestamp;
};

}  // namespace alidade::cli
