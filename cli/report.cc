// SPDX-License-Identifier: Apache-2.0
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <memory>

#include "alidade/io/output_file.h"
#include "alidade/report/page.h"
#include "command.h"
#include "console.h"

namespace alidade::cli {
namespace {

constexpr const char* kReportFooter = R"(Examples:
  alidade report runs/05_depth_principled          write runs/05_depth_principled/report.html
  alidade report runs/sweep -o sweep.html

The page is one file. It needs no network. If it exists, it is replaced.)";

struct ReportArguments {
  std::string folder;
  std::string output;
};

ExitCode WritePage(const ReportArguments& arguments) {
  const std::filesystem::path folder = arguments.folder;
  std::filesystem::path output = arguments.output;
  if (output.empty()) output = folder / "report.html";
  const std::string page = ReportPage(folder);
  internal::OutputFile file(output);
  file.Write(page);
  file.Close();
  Print("wrote " + output.string() + '\n');
  return ExitCode::kOk;
}

}  // namespace

void AddReport(CLI::App& program, Action& action) {
  CLI::App& command = *program.add_subcommand(
      "report", "Write the interactive page of a run, a comparison or a sweep");
  const auto arguments = std::make_shared<ReportArguments>();
  command
      .add_option("DIR", arguments->folder, "folder that `run`, `compare` or `sweep` has written")
      ->option_text(" ")
      ->required()
      ->check(IsNonEmpty);
  command.add_option("-o,--output", arguments->output, "page to write (default DIR/report.html)")
      ->option_text("FILE")
      ->check(IsNonEmpty);
  command.footer(kReportFooter);
  command.callback(
      [&action, arguments] { action = [arguments] { return WritePage(*arguments); }; });
}

}  // namespace alidade::cli
