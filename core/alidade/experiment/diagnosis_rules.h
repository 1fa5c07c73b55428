// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "alidade/experiment/diagnosis.h"
#include "alidade/experiment/innovation_view.h"

/// Rules of Diagnose. Each rule tests the innovations of one sensor, and returns its finding or
/// nullopt. diagnosis.cc lists the rules.
namespace alidade::internal {

using MaybeFinding = std::optional<Finding>;

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

/// Returns ` (near the factor between mm and m, ...)` if the ratio is near the factor between two
/// units, otherwise "".
std::string UnitHint(double ratio);

// Errors that exceed the noise by far. These rules need only a few measurements.
MaybeFinding TestTimeUnit(const InnovationView& view);
MaybeFinding TestUnit(const InnovationView& view);
MaybeFinding TestPrior(const InnovationView& view);
MaybeFinding TestDomain(const InnovationView& view);
MaybeFinding TestRejections(const InnovationView& view);
MaybeFinding TestSwap(const InnovationView& view);
MaybeFinding TestStuck(const InnovationView& view);

// Errors of the size of the noise. These rules need kMinDiagnosedFrames frames.
MaybeFinding TestNoiseModel(const InnovationView& view);
MaybeFinding TestTails(const InnovationView& view);
MaybeFinding TestElements(const InnovationView& view);
MaybeFinding TestTimeOffset(const InnovationView& view);
MaybeFinding TestBias(const InnovationView& view);
MaybeFinding TestCorrelation(const InnovationView& view);
MaybeFinding TestScaleOfNis(const InnovationView& view);

}  // namespace alidade::internal
