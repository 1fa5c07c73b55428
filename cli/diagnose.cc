// SPDX-License-Identifier: Apache-2.0
#include <stdlib.h>

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <memory>

#include "alidade/base/text.h"
#include "alidade/compare/diagnosis_report.h"
#include "alidade/replay/replay.h"
#include "command.h"
#include "console.h"

namespace alidade::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDiagnoseFooter = R"(Examples:
  alidade diagnose runs/05_depth_principled        findings about the innovations of a run
  alidade diagnose runs/05_depth_principled --why  also test each sigma and clock offset

--why repeats each recursive filter with the data of the run, twice for each sigma, noise density,
clock offset and constant of the config. It prints each number that is wrong, and a better one.
The exit code is 0 with and without findings.)";

struct DiagnoseArguments {
  std::string folder, estimator;
  bool why = false, json = false;
};

/// Config of a finished run, and the plugins with which it was run.
struct RecordedRun {
  Config config;
  PluginHost host;
};

/// Refuses data that are not those of the run. Prints a note on other inputs that have changed.
void CheckInputs(const fs::path& folder, const internal::RecordedInputs& recorded,
                 const RecordedRun& run) {
  const std::string file = (folder / internal::kInputsFile).string();
  const std::string inputs = internal::ReadInputTexts(folder).inputs;
  const std::vector<fs::path> plugins = internal::FindUsedPlugins({run.config}, run.host);
  const std::string current = internal::InputsJson(recorded.command, run.config, {run.config},
                                                   internal::HashFiles(plugins));
  const auto data = internal::DataDifferences(inputs, file, current);
  if (!data.empty()) {
    throw Error(ExitCode::kBadData,
                ErrorLine(Place{file}, {},
                          "the data have changed since the run: " + internal::Join(data, "; "),
                          "the data of the run; repeat the run with the new data"));
  }
  const auto changed = internal::InputDifferences(inputs, file, current);
  if (!changed.empty()) PrintNote("note: inputs have changed: " + internal::Join(changed, "; "));
}

RecordedRun ReadRecordedRun(const std::string& folder) {
  const internal::RecordedInputs recorded = internal::ReadReplayable(folder);
  std::string folders;
  for (const fs::path& path : recorded.command.plugin_folders) {
    folders += (folders.empty() ? "" : ":") + path.string();
  }
  ::setenv("ALIDADE_PLUGIN_PATH", folders.c_str(), 1);
  Input input{(fs::path(folder) / internal::kResolvedConfig).string(), {}, {}, true};
  std::error_code ignored;
  for (const fs::path& path : recorded.command.plugin_paths) {
    if (fs::exists(path, ignored)) input.plugin_paths.push_back(path.string());
  }
  Config config = input.Load();
  PluginHost host = input.HostFor(config);
  RecordedRun run{std::move(config), std::move(host)};
  CheckInputs(folder, recorded, run);
  return run;
}

/// Returns the estimator that the user named, or all estimators of the run.
std::vector<EstimatorInnovations> ReadEstimators(const DiagnoseArguments& arguments) {
  std::vector<EstimatorInnovations> estimators = ReadFinishedInnovations(arguments.folder);
  if (arguments.estimator.empty()) return estimators;
  std::vector<std::string> names;
  for (const EstimatorInnovations& entry : estimators) names.push_back(entry.estimator);
  std::erase_if(estimators, [&](const EstimatorInnovations& entry) {
    return entry.estimator != arguments.estimator;
  });
  if (estimators.empty()) {
    throw Error(ExitCode::kUsage,
                ErrorLine(Place{"--estimator"}, {},
                          "the run has no estimator '" + arguments.estimator + "'",
                          internal::Join(names), Nearest(arguments.estimator, names)));
  }
  return estimators;
}

std::vector<ParameterTests> TestEach(const std::vector<EstimatorInnovations>& estimators,
                                     const DiagnoseArguments& arguments) {
  const RecordedRun run = ReadRecordedRun(arguments.folder);
  StopOnSignals();
  Progress progress("runs of the filter", arguments.json);
  const LogScope quiet("", LogLevel::kDebug);  // the run has already reported its events
  std::vector<ParameterTests> tests;
  for (const EstimatorInnovations& entry : estimators) {
    tests.push_back(
        TestParameters(run.config, run.host, entry.estimator,
                       {[&](std::int64_t done, std::int64_t total) { progress.Show(done, total); },
                        StopRequested}));
  }
  return tests;
}

ExitCode DiagnoseRun(const DiagnoseArguments& arguments) {
  const std::vector<EstimatorInnovations> estimators = ReadEstimators(arguments);
  if (!arguments.json) PrintText(DiagnosisText(estimators));
  std::vector<ParameterTests> tests;
  if (arguments.why) tests = TestEach(estimators, arguments);
  arguments.json ? Print(DiagnosisJson(estimators, tests)) : PrintText(ParameterTestsText(tests));
  return ExitCode::kOk;
}

}  // namespace

void AddDiagnose(CLI::App& program, Action& action) {
  CLI::App& command = *program.add_subcommand(
      "diagnose", "Find errors of models, units and noise in the innovations of a run");
  const auto arguments = std::make_shared<DiagnoseArguments>();
  command.add_option("RUN", arguments->folder, "folder of a finished run")
      ->option_text(" ")
      ->required()
      ->check(IsNonEmpty);
  command.add_flag("--why", arguments->why,
                   "repeat the filters to find the parameters that explain the innovations");
  command
      .add_option("--estimator", arguments->estimator,
                  "diagnose this estimator only; default: all estimators of the run")
      ->option_text("NAME");
  command.add_flag("--json", arguments->json, "print JSON");
  command.footer(kDiagnoseFooter);
  command.callback(
      [&action, arguments] { action = [arguments] { return DiagnoseRun(*arguments); }; });
}

}  // namespace alidade::cli
