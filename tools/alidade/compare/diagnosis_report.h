// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "alidade/compare/finished_innovations.h"

namespace alidade {

/// Returns the findings about the innovations of each estimator, one line for each. A sensor with
/// too few measurements is reported as not tested.
std::string DiagnosisText(std::span<const EstimatorInnovations> estimators);
/// Returns the same as JSON: {"estimators": {NAME: {"diagnosis": [...], "not_tested": [SENSOR]}}}.
std::string DiagnosisJson(std::span<const EstimatorInnovations> estimators);

}  // namespace alidade
