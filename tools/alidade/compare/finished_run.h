// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "alidade/compare/cpu_clock.h"
#include "alidade/compare/over_seeds.h"
#include "alidade/experiment/run.h"
#include "alidade/io/json.h"
#include "alidade/record/estimate_series.h"

/// Data of runs for a comparison. The data are from memory or from run folders.
namespace alidade::internal {

struct ComparedRun;

/// Estimator of a comparison.
struct Candidate {
  std::string name;                  ///< name in the comparison
  const ComparedRun* run = nullptr;  ///< run that contains the estimator
  EstimatorResult result;            ///< result of the estimator, without events
  Series series;
  CpuTime cpu;         ///< CPU time; zero if unknown
  ErrorSeries errors;  ///< errors, if the run is one of several seeds; otherwise empty
  std::int64_t not_finite_rows = 0;     ///< rows of estimates.csv with a value that is not finite
  bool had_rejection_recovery = false;  ///< true: the event `rejection_recovery` occurred

  bool is_batch() const { return result.kind == EstimatorKind::kBatch; }
  /// Returns true if the estimator can be a reference: it did not fail and has estimates.
  bool is_usable() const { return !result.failed && !series.timestamps.empty(); }
  /// Returns the number of measurements that the estimator received.
  std::int64_t measurements() const;
  /// Returns the number of measurements that the estimator used.
  std::int64_t used() const;
};

/// Run of a comparison, with the estimators of the run.
struct ComparedRun {
  std::filesystem::path folder;  ///< "": the run has no folder
  RunStatus status = RunStatus::kOk;
  std::string reason;
  std::string reference = "truth";  ///< reference of the metrics
  std::string measurements_sha256, truth_sha256;
  std::int64_t frames = 0;
  std::vector<Candidate> estimators;
};

/// Reads run.json. Refuses the folder of a sweep, and a run that is not finished.
Json ReadRunJson(const std::filesystem::path& folder);

/// Reads a run folder. Errors: kInputMissing if a file is missing, kBadData if a file is invalid or
/// the files do not match.
ComparedRun ReadRun(const std::filesystem::path& folder);

/// Refuses runs whose measurements have different hashes. Returns notes on other differences
/// between the runs: different truths, or different settings that concern all estimators. Error:
/// kBadData with both folders, both hashes and the first timestamp that differs.
std::vector<std::string> CheckSameData(const std::vector<ComparedRun>& runs);

}  // namespace alidade::internal
