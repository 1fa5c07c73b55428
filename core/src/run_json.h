// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include "alidade/run.h"

namespace alidade::internal {

/// What run.json says beside the result.
struct RunFacts {
  std::uint64_t seed = 0;
  std::multimap<std::string, std::string> plugins;  ///< file name -> SHA-256, for each file
  std::map<std::string, std::string> types;         ///< estimator -> its type
};

/// The text of `run.json`: keys as in docs/run_folder.md, which other programs read.
std::string RunJson(const RunResult& result, const RunFacts& facts);

/// The text of `comparison.csv`: every metric and count, a column for each estimator.
std::string ComparisonCsv(const RunResult& result);

/// How many events there are of each kind.
std::map<std::string, std::int64_t> CountEvents(const EstimatorResult& result);

}  // namespace alidade::internal
