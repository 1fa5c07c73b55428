// SPDX-License-Identifier: Apache-2.0
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <memory>

#include "alidade/evaluate/evaluation_page.h"
#include "alidade/report/page.h"
#include "command.h"
#include "console.h"

namespace alidade::cli {
namespace {

constexpr const char* kReportFooter = R"(Examples:
  alidade report runs/05_depth_principled          write runs/05_depth_principled/report.html
  alidade report runs/sweep -o sweep.html
  alidade report orb.tum --reference truth.tum     write orb.html; errors without alignment

The page is one file. It needs no network. If it exists, it is replaced. `alidade eval -o` writes
the page of trajectories with an alignment.)";

struct ReportArguments {
  std::string path, reference, output;
};

/// Returns the page of the trajectories at `path`, with their errors relative to a reference.
std::string TrajectoryPage(const ReportArguments& arguments) {
  const Trajectory reference = ReadTrajectory(ReferenceAt(arguments.reference).file);
  std::vector<Evaluation> evaluations;
  for (const TrajectoryFile& file : EstimatesAt(arguments.path)) {
    evaluations.push_back(Evaluate(reference, ReadTrajectory(file.file), {}));
    evaluations.back().label = file.label;
  }
  return EvaluationPage(evaluations);
}

ExitCode WriteReport(const ReportArguments& arguments) {
  const std::filesystem::path path = arguments.path;
  const bool has_reference = !arguments.reference.empty();
  std::filesystem::path output = arguments.output;
  if (output.empty()) {
    output = std::filesystem::is_directory(path)
                 ? path / "report.html"
                 : std::filesystem::path(path).replace_extension(".html");
  }
  ProtectInputs(output, {arguments.reference});
  WritePageFile(output, has_reference ? TrajectoryPage(arguments) : ReportPage(path));
  PrintText("report   " + output.string() + '\n');
  return ExitCode::kOk;
}

}  // namespace

void AddReport(CLI::App& program, Action& action) {
  CLI::App& command = *program.add_subcommand(
      "report", "Write the interactive page of a run, a comparison, a sweep or a trajectory");
  const auto arguments = std::make_shared<ReportArguments>();
  command
      .add_option("DIR | EST", arguments->path,
                  "folder of `run`, `compare`, `sweep` or `bundle`; with --reference, a trajectory "
                  "or a folder with trajectories")
      ->option_text(" ")
      ->required()
      ->check(IsNonEmpty);
  command
      .add_option("--reference", arguments->reference,
                  "trajectory or folder with the true poses, as for `alidade eval`")
      ->option_text("REF")
      ->check(IsNonEmpty);
  command
      .add_option("-o,--output", arguments->output,
                  "page to write; default: DIR/report.html, or EST with the extension .html")
      ->option_text("FILE")
      ->check(IsNonEmpty);
  command.footer(kReportFooter);
  command.callback(
      [&action, arguments] { action = [arguments] { return WriteReport(*arguments); }; });
}

}  // namespace alidade::cli
