// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "alidade/base/enum_table.h"
#include "alidade/diagnosis/innovation_series.h"

namespace alidade {

/// Kinds of findings about the innovations of a sensor, in the order of kFindingKinds: a finding
/// that explains others precedes them.
enum class FindingKind {
  kTimeUnit,
  kUnit,
  kPriorFar,
  kOutOfDomain,
  kRejected,
  kSwapped,
  kStuck,
  kTimeOffset,
  kHeteroscedastic,
  kHeavyTails,
  kElement,
  kBias,
  kAnticorrelated,
  kCorrelated,
  kOverconfident,
  kUnderconfident,
};

/// Name and meaning of a kind of finding.
struct FindingKindInfo {
  FindingKind kind;
  const char* name;     ///< name in files
  const char* meaning;  ///< description in the documentation
};

/// All kinds of findings. To add a kind, add a value of FindingKind, an entry here, and its rule.
inline constexpr std::array kFindingKinds = {
    FindingKindInfo{FindingKind::kTimeUnit, "time_unit",
                    "time steps are longer than 10 s and measurements far from their predictions: "
                    "the times may be in ms"},
    FindingKindInfo{FindingKind::kUnit, "unit",
                    "measurements and predictions differ by the factor between two units"},
    FindingKindInfo{FindingKind::kPriorFar, "prior_far",
                    "one of the first measurements is far from its prediction by the prior"},
    FindingKindInfo{FindingKind::kOutOfDomain, "out_of_domain",
                    "the sensor model is not defined at most estimates"},
    FindingKindInfo{FindingKind::kRejected, "rejected",
                    "most measurements of the sensor were rejected, or many in a row"},
    FindingKindInfo{FindingKind::kSwapped, "swapped",
                    "two elements of the measurement appear to be exchanged"},
    FindingKindInfo{FindingKind::kStuck, "stuck",
                    "an element of the measurement was repeated 20 times in a row"},
    FindingKindInfo{FindingKind::kTimeOffset, "time_offset",
                    "innovations are proportional to the predicted rate: the clock of this or of "
                    "another sensor is off"},
    FindingKindInfo{FindingKind::kHeteroscedastic, "heteroscedastic",
                    "the noise depends on the measured quantity in another way than in the model"},
    FindingKindInfo{FindingKind::kHeavyTails, "heavy_tails", "there are outliers"},
    FindingKindInfo{FindingKind::kElement, "element",
                    "the sigma of one element of the measurement is wrong"},
    FindingKindInfo{FindingKind::kBias, "bias", "the mean innovation is not zero"},
    FindingKindInfo{FindingKind::kAnticorrelated, "anticorrelated",
                    "successive innovations have a negative correlation: the process noise is too "
                    "large"},
    FindingKindInfo{FindingKind::kCorrelated, "correlated",
                    "successive innovations have a positive correlation: the process noise is too "
                    "small, or an error of the model is not estimated"},
    FindingKindInfo{FindingKind::kOverconfident, "overconfident",
                    "innovations are larger than predicted"},
    FindingKindInfo{FindingKind::kUnderconfident, "underconfident",
                    "innovations are smaller than predicted"},
};
static_assert(
    internal::HasEntryForEach(kFindingKinds, &FindingKindInfo::kind, FindingKind::kUnderconfident),
    "kFindingKinds must have one entry for each FindingKind, in the order of FindingKind");

/// Finding about the innovations of one sensor.
struct Finding {
  FindingKind kind;
  std::string sensor;
  std::string text;        ///< one sentence with the figures and a remedy
  double statistic = 0.0;  ///< value that the rule compares with its threshold
};

/// Returns the findings about the innovations of each sensor, in the order of kFindingKinds. Each
/// rule has a probability of a false alarm of about 1e-6. A sensor with fewer than
/// kMinDiagnosedFrames frames with an accepted measurement is tested only for units, its prior, the
/// domain and rejections.
///
/// Source       [BarShalom2001] sec. 5.4.
std::vector<Finding> Diagnose(std::span<const InnovationSeries> sensors);
inline constexpr int kMinDiagnosedFrames = 30;

/// Returns whether Diagnose tests the size of the innovations of a sensor.
inline bool IsScaleTested(const InnovationSeries& series) {
  return !series.has_robust_loss && series.accepted_frames() >= kMinDiagnosedFrames;
}

/// Returns the name of a kind in files.
inline const char* ToString(FindingKind kind) {
  return kFindingKinds[static_cast<std::size_t>(kind)].name;
}

}  // namespace alidade
