// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/record/recorded_run.h"

namespace alidade::internal {

/// Contents of run.json in addition to the result.
struct RunFacts {
  std::uint64_t seed = 0;
  std::multimap<std::string, std::string> plugins;  ///< file name -> SHA-256
  RecordedRun recorded;                             ///< the csv files, after they are closed
  std::string measurements_sha256, truth_sha256;    ///< hashes of DataHash; "": no data
};

/// Returns the text of `run.json` for an unfinished run: `running` or `failed`, with the reason.
std::string UnfinishedRunJson(const std::string& status, const std::string& reason);

/// Returns the text of `run.json`, which other programs read. docs/run_folder.md lists its keys.
std::string RunJson(const RunResult& result, const RunFacts& facts);

/// Returns the text of `comparison.csv`: every metric and count, with a column for each estimator.
std::string ComparisonCsv(const RunResult& result);

/// Counts the events of each kind.
std::map<std::string, std::int64_t> CountEvents(const EstimatorResult& result);

}  // namespace alidade::internal
