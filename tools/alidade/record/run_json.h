// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/record/estimate_series.h"

namespace alidade::internal {

/// What run.json says of an estimator besides its result.
struct EstimatorFacts {
  std::string type;
  EstimatorKind kind = EstimatorKind::kFilter;
  bool smoothed = false;    ///< its estimates rest on later data too
  std::string accepted_by;  ///< the estimator that chose its measurements, or ""
  std::string overrides;    ///< of the config, as YAML, or ""
  std::vector<std::string> sensors;
  std::string position_block;  ///< the block of a position that landmarks are seen from, or ""
  std::vector<SeriesBlock> blocks;
  std::int64_t rows = 0;  ///< of estimates.csv
};

/// What run.json says besides the result.
struct RunFacts {
  std::uint64_t seed = 0;
  std::multimap<std::string, std::string> plugins;  ///< file name -> SHA-256, for each file
  std::map<std::string, EstimatorFacts> estimators;
  std::string measurements_sha256, truth_sha256;  ///< of DataHash; "": there are none
};

EstimatorFacts FactsOf(const NamedEstimator& named, const Experiment& experiment);

/// The text of `run.json` of a run that is not finished: `running` or `failed`, with the reason.
std::string UnfinishedRunJson(const std::string& status, const std::string& reason);

/// The text of `run.json`: keys as in docs/run_folder.md, which other programs read.
std::string RunJson(const RunResult& result, const RunFacts& facts);

/// The text of `comparison.csv`: every metric and count, a column for each estimator.
std::string ComparisonCsv(const RunResult& result);

/// How many events there are of each kind.
std::map<std::string, std::int64_t> CountEvents(const EstimatorResult& result);

}  // namespace alidade::internal
