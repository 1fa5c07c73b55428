// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/record/contents.h"

namespace alidade::internal {

/// What run.json says besides the result.
struct RunFacts {
  std::uint64_t seed = 0;
  std::multimap<std::string, std::string> plugins;  ///< file name -> SHA-256, for each file
  RecordedRun recorded;                             ///< the csv files, once they are closed
  std::string measurements_sha256, truth_sha256;    ///< of DataHash; "": there are none
};

/// The text of `run.json` of a run that is not finished: `running` or `failed`, with the reason.
std::string UnfinishedRunJson(const std::string& status, const std::string& reason);

/// The text of `run.json`: keys as in docs/run_folder.md, which other programs read.
std::string RunJson(const RunResult& result, const RunFacts& facts);

/// The text of `comparison.csv`: every metric and count, a column for each estimator.
std::string ComparisonCsv(const RunResult& result);

/// How many events there are of each kind.
std::map<std::string, std::int64_t> CountEvents(const EstimatorResult& result);

}  // namespace alidade::internal
