// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "alidade/compare/finished_innovations.h"
#include "alidade/experiment/parameter_tests.h"

namespace alidade {

/// Returns the findings about the innovations of each estimator, one line for each. A sensor with
/// too few measurements is reported as not tested.
std::string DiagnosisText(std::span<const EstimatorInnovations> estimators);
/// Returns the parameters of each estimator whose test is an alarm, with the setting that changes
/// the parameter.
std::string ParameterTestsText(std::span<const ParameterTests> estimators);
/// Returns both as JSON: {"estimators": {NAME: {"diagnosis": [...], "not_tested": [SENSOR],
/// "parameters": {"tested": [...], "not_tested": [...]}}}}. An estimator that `tests` does not
/// contain has no key `parameters`.
std::string DiagnosisJson(std::span<const EstimatorInnovations> estimators,
                          std::span<const ParameterTests> tests = {});

}  // namespace alidade
