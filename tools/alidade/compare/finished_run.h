// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "alidade/compare/cpu_clock.h"
#include "alidade/compare/over_seeds.h"
#include "alidade/experiment/run.h"
#include "alidade/record/estimate_series.h"

/// Runs as far as they are compared, from memory or from their folders.
namespace alidade::internal {

struct ComparedRun;

/// One estimator of a comparison.
struct Candidate {
  std::string name;                  ///< as the comparison has it
  const ComparedRun* run = nullptr;  ///< of which it is one
  EstimatorResult result;            ///< without events
  Series series;
  CpuTime cpu;                          ///< as far as it is known
  ErrorSeries errors;                   ///< if they are wanted
  std::int64_t not_finite = 0;          ///< rows of estimates.csv with a cell that is not finite
  bool had_rejection_recovery = false;  ///< event `rejection_recovery`

  bool batch() const { return result.kind == EstimatorKind::kBatch; }
  /// Whether its estimates are of use to compare with.
  bool usable() const { return !result.failed && !series.timestamps.empty(); }
  /// Measurements that it was given, and those of them that it used.
  std::int64_t measurements() const;
  std::int64_t used() const;
};

struct ComparedRun {
  std::filesystem::path folder;  ///< "": it has none
  RunStatus status = RunStatus::kOk;
  std::string reason;
  std::string reference = "truth";  ///< what its metrics compare with
  std::string measurements_sha256, truth_sha256;
  std::int64_t frames = 0;
  std::vector<Candidate> estimators;
};

/// A run folder. Errors: kInputMissing where it is none, kBadData where its files do not fit
/// together.
ComparedRun ReadRun(const std::filesystem::path& folder);

/// Refuses runs whose measurements differ, by their hashes; what else differs between them, their
/// truth or the settings that all their estimators share, is told. Errors: kBadData with both
/// folders, both hashes and the first timestamp that differs.
std::vector<std::string> CheckSameData(const std::vector<ComparedRun>& runs);

}  // namespace alidade::internal
