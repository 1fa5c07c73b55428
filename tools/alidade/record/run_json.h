// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/io/json.h"
#include "alidade/record/recorded_run.h"
#include "alidade/report/conclusion.h"

namespace alidade::internal {

/// Facts in run.json that are not part of RunResult.
struct RunFacts {
  std::uint64_t seed = 0;
  std::multimap<std::string, std::string> plugins;  ///< file name -> SHA-256
  std::vector<RecordedEstimator> recorded;          ///< files of each estimator
  std::vector<Conclusion> conclusions;              ///< result of ConclusionsOf()
  std::string measurements_sha256, truth_sha256;    ///< hashes from DataHash; "": no data
};

/// Returns the text of `run.json` for an unfinished run. `status` is `running` or `failed`.
std::string UnfinishedRunJson(const std::string& status, const std::string& reason);

/// Returns the entry of an estimator in `run.json`. `recorded` describes its files; null: there are
/// no files.
Json EstimatorJson(const EstimatorResult& result, const RecordedEstimator* recorded);

/// Returns the list of findings as in `run.json`.
Json FindingsJson(std::span<const Finding> findings);

/// Returns the text of `run.json`, which other programs read. docs/run_folder.md lists the keys.
std::string RunJson(const RunResult& result, const RunFacts& facts);

/// Returns the text of `comparison.csv`, with a row for each metric and count and a column for each
/// estimator.
std::string ComparisonCsv(const RunResult& result);

/// Counts the events of each kind.
std::map<std::string, std::int64_t> CountEvents(const EstimatorResult& result);

}  // namespace alidade::internal
