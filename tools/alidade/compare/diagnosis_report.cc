// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/diagnosis_report.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "alidade/base/number_text.h"
#include "alidade/diagnosis/diagnosis.h"
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

using internal::RoundedText;

/// Returns a line about an alarm.
std::string AlarmText(const ParameterTest& test) {
  const std::string effect = test.alternative_to.empty()
                                 ? " explains the innovations better"
                                 : " has almost the same effect as " + test.alternative_to;
  return "  " + test.key + " is " + RoundedText(test.value, 4) + ", but " +
         RoundedText(test.better, 3) + effect + " (|z| = " + RoundedText(std::abs(test.z), 3) +
         ", log-likelihood +" + RoundedText(test.gain, 3) + "); try --set '" + test.setting + "'\n";
}

/// Returns a sentence for an estimator without an alarm. `tests` are sorted.
std::string NoAlarmText(const std::vector<ParameterTest>& tests) {
  const auto count = std::ranges::count(tests, std::string(), &ParameterTest::not_tested);
  if (count == 0) return "  no parameter could be tested\n";
  return "  no other value of a parameter explains the innovations significantly better: the "
         "largest "
         "|z| of " +
         std::to_string(count) + (count == 1 ? " parameter" : " parameters") + " is " +
         RoundedText(std::abs(tests.front().z), 3) + " (" + tests.front().key +
         "), which is below the threshold of " + RoundedText(kParameterAlarm) + '\n';
}

internal::Json ParametersJson(const ParameterTests& tests) {
  using internal::Json;
  Json tested = Json::array(), not_tested = Json::array();
  for (const ParameterTest& test : tests.parameters) {
    if (!test.not_tested.empty()) {
      not_tested.push_back({{"key", test.key}, {"because", test.not_tested}});
      continue;
    }
    Json& entry = tested.emplace_back(Json{{"key", test.key},
                                           {"value", test.value},
                                           {"z", test.z},
                                           {"alarm", test.is_alarm()},
                                           {"estimate", test.better},
                                           {"sigma", test.sigma},
                                           {"gain", test.gain},
                                           {"set", test.setting}});
    if (!test.alternative_to.empty()) entry["alternative_to"] = test.alternative_to;
  }
  Json json = {{"tested", tested}, {"not_tested", not_tested}};
  if (!tests.not_tested.empty()) json["because"] = tests.not_tested;
  return json;
}

}  // namespace

std::string ParameterTestsText(std::span<const ParameterTests> estimators) {
  std::string text;
  for (const ParameterTests& tests : estimators) {
    text += "parameters of " + tests.estimator + ":\n";
    if (!tests.not_tested.empty()) {
      text += "  not tested: " + tests.not_tested + '\n';
      continue;
    }
    bool has_alarm = false;
    for (const ParameterTest& test : tests.parameters) {
      if (!test.is_alarm()) continue;
      has_alarm = true;
      text += AlarmText(test);
    }
    text += has_alarm ? "  change only the first of these parameters, and repeat the diagnosis\n"
                      : NoAlarmText(tests.parameters);
    for (const ParameterTest& test : tests.parameters) {
      if (!test.not_tested.empty())
        text += "  " + test.key + ": not tested, because " + test.not_tested + '\n';
    }
  }
  return text;
}

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

std::string DiagnosisJson(std::span<const EstimatorInnovations> estimators,
                          std::span<const ParameterTests> tests) {
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
  for (const ParameterTests& estimator : tests) {
    json[estimator.estimator]["parameters"] = ParametersJson(estimator);
  }
  return internal::JsonText({{"estimators", json}});
}

}  // namespace alidade
