// SPDX-License-Identifier: Apache-2.0
#include "alidade/check/check.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/check/check_context.h"
#include "alidade/check/model_export.h"
#include "alidade/check/plugin_listing.h"
#include "alidade/experiment/estimator_registry.h"
#include "alidade/experiment/read_problem.h"
#include "alidade/experiment/short_forms.h"
#include "alidade/io/text_table.h"
#include "alidade/plugin/built_in_models.h"
#include "alidade/plugin/create.h"

namespace alidade {
namespace fs = std::filesystem;
namespace {

using internal::Check;
using internal::ChildEnd;
using internal::Context;
using internal::NumberText;

/// First character of the child's answer: kError for a set-up error, otherwise one of
/// kVerdictNames.
constexpr char kError = 'E';
constexpr char kVerdictNames[] = {'+', '-', '0', '!'};

std::string Encode(const CheckResult& finding) {
  return kVerdictNames[static_cast<int>(finding.verdict)] + finding.text;
}

CheckResult Decode(const std::string& answer) {
  if (answer.empty()) return internal::Fail("the check returned no verdict");
  if (answer.front() == kError) throw Error(ExitCode::kBadConfig, answer.substr(1));
  const auto* verdict =
      std::find(std::begin(kVerdictNames), std::end(kVerdictNames), answer.front());
  if (verdict == std::end(kVerdictNames)) return internal::Fail("the check returned no verdict");
  return {static_cast<CheckResult::Verdict>(verdict - kVerdictNames), "", answer.substr(1)};
}

/// Describes how the child ended, and names the call in which it ended.
std::string EndText(const ChildEnd& end, const internal::CallRecord& record, double timeout_s) {
  const std::string state = record.state().empty() ? "" : " at " + record.state();
  if (end.timed_out) {
    const std::string place =
        record.call().empty() ? "before its first call" : "in " + record.call() + state;
    return "the check took longer than " + NumberText(timeout_s) +
           " s (--timeout); it was stopped " + place;
  }
  std::string text = record.call().empty() ? "the check" : record.call();
  text += ' ' + end.text;
  if (!record.state().empty()) text += " at " + record.state();
  return text;
}

/// Runs one check in a child process. Sets `ended` if the child ended without an answer.
CheckResult RunCheck(const Check& check, const ModelCreator& creator, const CheckOptions& options,
                     bool& ended) {
  internal::CallRecord record;
  const auto work = [&]() -> std::string {
    try {
      Context context(creator, options, record);
      const CheckResult finding = check.run(context);
      context.Close();
      return Encode(finding);
    } catch (const Error& e) {
      return e.code() == ExitCode::kBadConfig ? kError + std::string(e.what())
                                              : Encode(internal::Fail(e.what()));
    } catch (const std::exception& e) {
      return Encode(internal::Fail(e.what()));
    }
  };
  const ChildEnd end = internal::RunInChild({options.timeout_s, options.memory_mb}, work);
  ended = !end.answered;
  CheckResult finding =
      end.answered ? Decode(end.text) : internal::Fail(EndText(end, record, options.timeout_s));
  if (finding.verdict == CheckResult::Verdict::kOk && check.run == internal::CheckEnvironment &&
      !end.printed.empty()) {
    finding = internal::Fail("the model prints text, which would mix with the output of a run: '" +
                             end.printed + "'");
  }
  const auto contains = [&](const char* words) {
    return finding.text.find(words) != std::string::npos;
  };
  // The second text appears if the stack of a thread cannot be allocated.
  if (contains("std::bad_alloc") || contains("Resource temporarily unavailable")) {
    finding.text += "; the memory limit is " + std::to_string(options.memory_mb) + " MB (--memory)";
  }
  return finding;
}

}  // namespace

std::vector<CheckResult> CheckModel(const ModelCreator& creator, const CheckOptions& options) {
  ALIDADE_EXPECTS(options.states > 0 && options.timeout_s > 0.0);
  std::vector<CheckResult> findings;
  std::string stopped_by;
  for (const Check& check : internal::kChecks) {
    CheckResult finding = internal::Skip("'" + stopped_by + "' failed");
    if (stopped_by.empty()) {
      bool ended = false;
      finding = RunCheck(check, creator, options, ended);
      const bool failed = finding.verdict == CheckResult::Verdict::kFail;
      if (failed && (check.needed || ended)) stopped_by = check.name;
    }
    finding.check = check.name;
    findings.push_back(std::move(finding));
  }
  return findings;
}

std::vector<CheckResult> CheckModel(const PluginEntry& entry, const Node& parameters,
                                    const CheckOptions& options) {
  ALIDADE_EXPECTS(entry.is_model());
  ModelCreator creator{[&] { return CreateModel(entry, parameters); }};
  if (!options.allows_unread_keys) creator.reject_unread = [&] { parameters.RejectUnread(); };
  return CheckModel(creator, options);
}

std::vector<ConfigModelCheck> CheckConfigModels(const Config& config, const PluginHost& host,
                                                const std::string& model,
                                                const CheckOptions& options) {
  constexpr unsigned kRungeKuttaOrder = 5;  // the error of a step of the Runge-Kutta method
  const bool is_linear = model == internal::kLinear;
  Config expanded = config.Copy();
  ExpandShortForms(expanded, host);
  const Problem problem = ReadProblem(expanded.root(), host, {});
  std::vector<ConfigModelCheck> checks;
  const auto add = [&](const char* kind, const std::string& path,
                       std::vector<CheckResult> findings) {
    PluginEntry entry;
    entry.kind = kind;
    entry.name = model;
    entry.plugin = config.name();
    checks.push_back({std::move(entry), path, std::move(findings)});
  };
  for (const MotionBinding& motion : problem.motions) {
    if (motion.model->name() != model) continue;
    const bool is_rate = config.root().At("state").At(motion.name).Find("rate").has_value();
    const unsigned order = is_rate && !is_linear ? kRungeKuttaOrder : 0;
    const ModelCreator creator{[&] { return internal::ExportModel(motion.model, order); }};
    std::vector<CheckResult> findings;
    if (is_linear && !is_rate) {
      findings = {internal::Skip("the discrete form exists only for multiples of step.period_s")};
      findings[0].check = "step";
    } else {
      findings = CheckModel(creator, options);
    }
    add(kMotionKind, "state." + motion.name, std::move(findings));
  }
  for (const SensorBinding& sensor : problem.sensors) {
    if (sensor.model->name() != model) continue;
    const ModelCreator creator{[&] { return internal::ExportModel(sensor.model); }};
    add(kSensorKind, "sensors." + sensor.name, CheckModel(creator, options));
  }
  if (checks.empty()) {
    config.root().Fail("no entry of `state` or `sensors` uses the model " + model,
                       "an entry with model: " + model);
  }
  return checks;
}

std::vector<PluginEntry> FindModels(const PluginHost& host, const std::string& plugin,
                                    const std::string& model) {
  std::error_code error;
  const fs::path file = fs::canonical(plugin, error);
  std::vector<PluginEntry> found;
  std::vector<std::string> names;
  const auto collect = [&](const auto& matches) {
    if (!found.empty()) return;
    for (const PluginEntry& entry : host.entries()) {
      if (entry.is_model() && matches(entry)) found.push_back(entry);
    }
  };
  if (!error) collect([&](const PluginEntry& entry) { return entry.plugin == file; });
  collect([&](const PluginEntry& entry) {
    const std::string stem = entry.plugin.stem().string();
    return stem == plugin || stem == "alidade_" + plugin;
  });
  collect([&](const PluginEntry& entry) { return entry.name == plugin; });
  if (found.empty()) {
    const auto entry_of_name = std::ranges::find(host.entries(), plugin, &PluginEntry::name);
    const bool built_in = internal::FindEstimatorType(plugin) != nullptr;
    if (built_in || entry_of_name != host.entries().end()) {
      const std::string kind = built_in ? "built-in estimator" : entry_of_name->kind;
      throw Error(ExitCode::kPlugin,
                  ErrorLine({}, {}, "'" + plugin + "' is " + internal::WithArticle(kind),
                            "a sensor or motion model"));
    }
    for (const PluginEntry& entry : host.entries()) {
      if (entry.is_model()) names.push_back(entry.name);
    }
    throw Error(ExitCode::kPlugin,
                ErrorLine({}, {}, "no sensor or motion model was found for '" + plugin + "'", {},
                          Nearest(plugin, names)) +
                    "\n" + PluginPlaces(host));
  }
  if (model.empty()) return found;
  for (const PluginEntry& entry : found) names.push_back(entry.name);
  std::erase_if(found, [&](const PluginEntry& entry) { return entry.name != model; });
  if (found.empty()) {
    throw Error(
        ExitCode::kPlugin,
        ErrorLine({}, {}, "plugin '" + plugin + "' does not contain a model '" + model + "'", {},
                  Nearest(model, names)));
  }
  return found;
}

std::string CheckText(const PluginEntry& entry, const std::vector<CheckResult>& findings) {
  constexpr const char* kWords[] = {"ok", "FAIL", "skipped", "warning"};
  std::vector<internal::TextRow> rows;
  std::array<int, std::size(kWords)> counts{};
  for (const CheckResult& finding : findings) {
    ++counts[static_cast<std::size_t>(finding.verdict)];
    std::string text = finding.text;
    std::replace(text.begin(), text.end(), '\n', ' ');
    rows.push_back({kWords[static_cast<int>(finding.verdict)], finding.check, text});
  }
  const auto count = [&](CheckResult::Verdict verdict, const char* word) {
    return std::to_string(counts[static_cast<std::size_t>(verdict)]) + word;
  };
  return entry.name + " (" + entry.kind + " of " + entry.plugin.string() + ")\n" +
         internal::TextTable(rows, 2) + std::to_string(findings.size()) +
         " checks: " + count(CheckResult::Verdict::kOk, " ok, ") +
         count(CheckResult::Verdict::kFail, " failed, ") +
         (counts.back() > 0 ? count(CheckResult::Verdict::kWarning, " warned, ") : "") +
         count(CheckResult::Verdict::kSkipped, " skipped\n");
}

bool AnyFailure(const std::vector<CheckResult>& findings) {
  return std::any_of(findings.begin(), findings.end(), [](const CheckResult& finding) {
    return finding.verdict == CheckResult::Verdict::kFail;
  });
}

}  // namespace alidade
