// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/base/enum_table.h"
#include "alidade/base/timestamp.h"
#include "alidade/diagnosis/diagnosis.h"
#include "alidade/diagnosis/measurement_log.h"
#include "alidade/estimation/event.h"

namespace alidade {

/// Verdict on the estimates of an estimator, from the worst to the best.
enum class VerdictState {
  kFailed,
  kDiverged,
  kLost,
  kMostlyRejected,
  kOverconfident,
  kUnderconfident,
  kNotTested,
  kConsistent,
};

/// Name and meaning of a verdict.
struct VerdictInfo {
  VerdictState state;
  const char* name;     ///< name in files and tables
  const char* meaning;  ///< description in the documentation
};

/// All verdicts. The first that applies is the verdict of an estimator.
inline constexpr std::array kVerdicts = {
    VerdictInfo{VerdictState::kFailed, "failed", "the estimator ended before the data did"},
    VerdictInfo{VerdictState::kDiverged, "diverged",
                "an estimate left the domain of its models, or P could not be repaired"},
    VerdictInfo{VerdictState::kLost, "lost",
                "the error of a block element exceeded 10 sigma for 20 timestamps in a row; "
                "requires truth"},
    VerdictInfo{VerdictState::kMostlyRejected, "mostly rejected",
                "more than half of the measurements of a sensor were rejected, or its last 20 in "
                "a row"},
    VerdictInfo{VerdictState::kOverconfident, "overconfident",
                "the errors are larger than P indicates: a mean NEES or NIS is too large"},
    VerdictInfo{VerdictState::kUnderconfident, "underconfident",
                "the errors are smaller than P indicates: a mean NEES or NIS is too small"},
    VerdictInfo{VerdictState::kNotTested, "not tested",
                "there were too few errors or innovations to test"},
    VerdictInfo{VerdictState::kConsistent, "consistent",
                "the tests by NEES and NIS, or without truth by NIS, were passed"},
};
static_assert(internal::HasEntryForEach(kVerdicts, &VerdictInfo::state, VerdictState::kConsistent),
              "kVerdicts must have one entry for each VerdictState, in the order of VerdictState");

/// Data that a verdict is based on.
enum class VerdictBasis { kNone, kNis, kNees };
/// Returns `none`, `nis` or `nees`.
const char* ToString(VerdictBasis basis);

/// Verdict on an estimator, with its reason.
struct Verdict {
  VerdictState state = VerdictState::kNotTested;
  std::string because;             ///< one sentence
  Timestamp since = kNoTimestamp;  ///< time from which the estimates are wrong, if known
  VerdictBasis basis = VerdictBasis::kNone;
};

/// Returns the name of a state: `mostly rejected`.
inline const char* ToString(VerdictState state) {
  return kVerdicts[static_cast<std::size_t>(state)].name;
}
/// Returns the state with this name, or nullopt.
std::optional<VerdictState> VerdictStateOf(std::string_view name);

/// NEES of the blocks of an owner over a run.
struct NeesSeries {
  std::string owner;
  double dof = 0.0;            ///< mean number of error elements
  std::vector<double> values;  ///< e' C^-1 e / dof, evenly thinned
};

/// Facts about a run that determine the verdict.
struct VerdictFacts {
  bool failed = false, diverged = false;
  std::string_view run_failure = {};  ///< reason why the run ended before the data did, or ""
  std::span<const Event> events = {};
  std::span<const SensorUse> sensors = {};
  std::span<const NeesSeries> nees = {};   ///< empty if the truth is unknown
  std::span<const Finding> findings = {};  ///< about the innovations
  int tested_sensors = 0;                  ///< sensors whose size of innovations was tested
};

/// Computes the verdict. TestScale tests the mean of n values of NEES / dof, as the mean of
/// n / (5 tau) independent values. tau is the autocorrelation time; the factor 5 allows for slow
/// components that a short run hides. Values that are nearly constant count as one. With a finding
/// about the innovations, the test is stricter. If the NEES passes, or without truth, findings
/// about the size of the innovations determine the verdict. The reason is then the first finding,
/// which usually explains the others.
Verdict ComputeVerdict(const VerdictFacts& facts);

}  // namespace alidade
