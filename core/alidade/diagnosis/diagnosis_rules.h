// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "alidade/diagnosis/diagnosis.h"
#include "alidade/diagnosis/innovation_view.h"

/// Rules of Diagnose. Each rule tests the innovations of one sensor, and returns its finding or
/// nullopt. diagnosis.cc lists the rules.
namespace alidade::internal {

/// Returns a finding with the text `SENSOR: text`.
inline Finding MakeFinding(FindingKind kind, const InnovationView& view, double statistic,
                           const std::string& text) {
  const std::string& sensor = view.series().sensor;
  return {kind, sensor, sensor + ": " + text, statistic};
}

/// Returns `element K: `, or "" for a measurement of one element.
inline std::string ElementPrefix(const InnovationView& view, std::size_t k) {
  return view.dof() == 1 ? "" : "element " + std::to_string(k) + ": ";
}

/// Returns ` (near the factor between mm and m, ...)` if the ratio is near the factor between the
/// unit and another, otherwise "". The unit "" stands for any unit.
std::string UnitHint(double ratio, const std::string& unit);

// Errors that exceed the noise by far. These rules need only a few measurements.
std::optional<Finding> TestTimeUnit(const InnovationView& view);
std::optional<Finding> TestUnit(const InnovationView& view);
std::optional<Finding> TestPrior(const InnovationView& view);
std::optional<Finding> TestDomain(const InnovationView& view);
std::optional<Finding> TestRejections(const InnovationView& view);
std::optional<Finding> TestSwap(const InnovationView& view);
std::optional<Finding> TestStuck(const InnovationView& view);

// Errors of the size of the noise. These rules need kMinDiagnosedFrames frames.
std::optional<Finding> TestNoiseModel(const InnovationView& view);
std::optional<Finding> TestTails(const InnovationView& view);
std::optional<Finding> TestElements(const InnovationView& view);
std::optional<Finding> TestTimeOffset(const InnovationView& view);
std::optional<Finding> TestBias(const InnovationView& view);
std::optional<Finding> TestCorrelation(const InnovationView& view);
std::optional<Finding> TestScaleOfNis(const InnovationView& view);

}  // namespace alidade::internal
