// SPDX-License-Identifier: Apache-2.0
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <memory>

#include "alidade/compare/diagnosis_report.h"
#include "command.h"
#include "console.h"

namespace alidade::cli {
namespace {

constexpr const char* kDiagnoseFooter = R"(Example:
  alidade diagnose runs/05_depth_principled        findings about the innovations of a run

The exit code is 0 with and without findings.)";

struct DiagnoseArguments {
  std::string folder;
  bool json = false;
};

ExitCode DiagnoseRun(const DiagnoseArguments& arguments) {
  const std::vector<EstimatorInnovations> estimators = ReadFinishedInnovations(arguments.folder);
  Print(arguments.json ? DiagnosisJson(estimators) : DiagnosisText(estimators));
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
  command.add_flag("--json", arguments->json, "print JSON");
  command.footer(kDiagnoseFooter);
  command.callback(
      [&action, arguments] { action = [arguments] { return DiagnoseRun(*arguments); }; });
}

}  // namespace alidade::cli
