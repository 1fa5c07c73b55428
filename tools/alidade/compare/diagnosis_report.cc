// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/diagnosis_report.h"

#include <nlohmann/json.hpp>

#include "alidade/experiment/diagnosis.h"
#include "alidade/record/run_json.h"

namespace alidade {
namespace {

bool IsTested(const InnovationSeries& series) {
  return series.accepted_frames() >= kMinDiagnosedFrames;
}

std::string NotTestedText(const InnovationSeries& series) {
  return series.sensor + ": not tested, because accepted measurements have only " +
         std::to_string(series.accepted_frames()) + " timestamps; " +
         std::to_string(kMinDiagnosedFrames) + " are necessary";
}

}  // namespace

std::string DiagnosisText(std::span<const EstimatorInnovations> estimators) {
  std::string text;
  for (const EstimatorInnovations& innovations : estimators) {
    const std::vector<Finding> findings = Diagnose(innovations.sensors);
    bool is_tested = false;
    text += "diagnosis of " + innovations.estimator + ":\n";
    for (const Finding& finding : findings) text += "  " + finding.text + '\n';
    for (const InnovationSeries& series : innovations.sensors) {
      is_tested = is_tested || IsTested(series);
      if (!IsTested(series)) text += "  " + NotTestedText(series) + '\n';
    }
    if (findings.empty() && is_tested) text += "  nothing found\n";
  }
  return text;
}

std::string DiagnosisJson(std::span<const EstimatorInnovations> estimators) {
  using internal::Json;
  Json json = Json::object();
  for (const EstimatorInnovations& innovations : estimators) {
    Json not_tested = Json::array();
    for (const InnovationSeries& series : innovations.sensors) {
      if (!IsTested(series)) not_tested.push_back(series.sensor);
    }
    json[innovations.estimator] = {
        {"diagnosis", internal::FindingsJson(Diagnose(innovations.sensors))},
        {"not_tested", not_tested}};
  }
  return internal::JsonText({{"estimators", json}});
}

}  // namespace alidade
