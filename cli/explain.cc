// SPDX-License-Identifier: Apache-2.0
#include "alidade/check/explain.h"

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <memory>

#include "command.h"
#include "console.h"

namespace alidade::cli {
namespace {

constexpr const char* kExplainFooter = R"(Examples:
  alidade explain config.yaml -o model.html
  alidade explain examples/05_depth_principled/config.yaml --set estimators.ekf.fuse=per_sensor)";

struct ExplainArguments {
  Input input;
  std::string page;  ///< file of the page; "": print the text
};

ExitCode ExplainConfig(const ExplainArguments& arguments) {
  const Config written = arguments.input.Load();
  const PluginHost host = arguments.input.Host(written);
  const Experiment experiment = BuildExperiment(written, host);
  const Config& config = *experiment.config;
  if (arguments.page.empty()) {
    PrintText(Explain(config, experiment));
    return ExitCode::kOk;
  }
  ProtectInputs(arguments.page, config.inputs());
  WritePageFile(arguments.page, ExplainPage(config, experiment, host));
  Print("report   " + arguments.page + '\n');
  return ExitCode::kOk;
}

}  // namespace

void AddExplain(CLI::App& program, Action& action) {
  CLI::App& command = *program.add_subcommand(
      "explain", "Describe a config: state, models, roles, unobservable directions");
  const auto arguments = std::make_shared<ExplainArguments>();
  arguments->input.AddTo(command);
  command
      .add_option("-o,--output", arguments->page,
                  "page to write instead of the text, with a drawing of the model")
      ->option_text("FILE.html")
      ->check(IsNonEmpty);
  command.footer(kExplainFooter);
  command.callback(
      [&action, arguments] { action = [arguments] { return ExplainConfig(*arguments); }; });
}

}  // namespace alidade::cli
