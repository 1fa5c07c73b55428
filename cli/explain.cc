// SPDX-License-Identifier: Apache-2.0
#include "alidade/check/explain.h"

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <memory>

#include "command.h"
#include "console.h"

namespace alidade::cli {
namespace {

constexpr const char* kExplainFooter = R"(Example:
  alidade explain examples/05_depth_principled/config.yaml --set estimators.ekf.fuse=per_sensor)";

ExitCode ExplainConfig(const Input& input) {
  const Config config = input.Load();
  const PluginHost host = input.Host(config);
  PrintText(Explain(config, BuildExperiment(config, host)));
  return ExitCode::kOk;
}

}  // namespace

void AddExplain(CLI::App& program, Action& action) {
  CLI::App& command = *program.add_subcommand(
      "explain", "Describe a config: state, models, roles, unobservable directions");
  const auto input = std::make_shared<Input>();
  input->AddTo(command);
  command.footer(kExplainFooter);
  command.callback([&action, input] { action = [input] { return ExplainConfig(*input); }; });
}

}  // namespace alidade::cli
