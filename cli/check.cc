// SPDX-License-Identifier: Apache-2.0
#include "alidade/check.h"

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <memory>

#include "command.h"
#include "console.h"

namespace alidade::cli {
namespace fs = std::filesystem;
namespace {

constexpr const char* kFooter = R"(Examples:
  alidade check build/alidade_range_rate.so --set sigma_m_s=0.5
  alidade check constant_velocity --set noise.acceleration=1
  alidade check mine.so radar --set sigma_m_s=0.5 --states 500 --seed 7

Each check is a line: ok, FAIL or skipped, and what was seen. A plugin that crashes, ends the process,
hangs or eats memory ends nothing but its check. Exits with 1 where a line says FAIL, 78 where a
parameter is missing or wrong. Of a plugin with several models, `--set MODEL.key=value`.)";

struct Arguments {
  std::string plugin, model;
  std::vector<std::string> sets, plugin_paths;
  CheckOptions options;
};

bool IsFile(const std::string& plugin) {
  std::error_code ignored;
  return plugin.find('/') != plugin.npos || fs::is_regular_file(plugin, ignored);
}

/// The parameters that the command line gives the model `entry`, which is the only one or not.
Config Parameters(const Arguments& arguments, const PluginEntry& entry, bool only) {
  Config config = Config::FromText("{}", entry.name);
  for (const std::string& set : arguments.sets) {
    const std::string prefix = only ? "" : entry.name + '.';
    const std::size_t equals = set.find('=');
    const std::string key = set.substr(0, equals);
    if (!key.starts_with(prefix)) continue;
    config.Set(key.substr(prefix.size()), set.substr(equals + 1), "--set");
  }
  return config;
}

/// Refuses a `--set` that is of none of several models.
void RequireModels(const Arguments& arguments, const std::vector<PluginEntry>& entries) {
  for (const std::string& set : arguments.sets) {
    const auto is_of = [&](const PluginEntry& entry) { return set.starts_with(entry.name + '.'); };
    if (entries.size() == 1 || std::any_of(entries.begin(), entries.end(), is_of)) continue;
    throw Error(ExitCode::kBadConfig,
                ErrorLine({"--set"}, set.substr(0, set.find('=')), "of which model?",
                          "MODEL.key=value, as the plugin has several; or name the MODEL"));
  }
}

ExitCode Check(const Arguments& arguments) {
  std::vector<fs::path> places = Absolute(arguments.plugin_paths);
  if (IsFile(arguments.plugin)) {
    places.insert(places.begin(), Absolute({arguments.plugin}).front());
  }
  const PluginHost host(places);
  const auto entries = FindModels(host, arguments.plugin, arguments.model);
  RequireModels(arguments, entries);
  bool failed = false;
  for (const PluginEntry& entry : entries) {
    const Config parameters = Parameters(arguments, entry, entries.size() == 1);
    const auto findings = CheckModel(host, entry, parameters.root(), arguments.options);
    Print(CheckText(entry, findings));
    failed = failed || AnyFailure(findings);
  }
  return failed ? ExitCode::kFound : ExitCode::kOk;
}

}  // namespace

void AddCheck(CLI::App& program, Action& action) {
  CLI::App& command =
      *program.add_subcommand("check", "Check that the models of a plugin keep the rules");
  const auto arguments = std::make_shared<Arguments>();
  CheckOptions& options = arguments->options;
  command
      .add_option("PLUGIN", arguments->plugin, "a plugin file, or the name of one or of a model")
      ->option_text(" ")
      ->required()
      ->check(IsNamed);
  command.add_option("MODEL", arguments->model, "of its models, this one")->option_text(" ");
  AddSets(command, arguments->sets, "set a parameter of the model; may be repeated");
  AddPluginPath(command, arguments->plugin_paths);
  command.add_option("--seed", options.seed, "of the random states; default 1")->option_text("N");
  command.add_option("--states", options.states, "number of random states; default 48")
      ->option_text("N")
      ->check(CLI::Range(1, 1000000));
  command.add_option("--timeout", options.timeout_s, "of each check, in seconds; default 10")
      ->option_text("S")
      ->check(CLI::Range(0.01, 1e6));
  command.add_option("--memory", options.memory_mb, "that a model may take, in MB; default 1024")
      ->option_text("MB")
      ->check(CLI::Range(16, 1 << 30));
  command
      .add_option("--step-order", options.step_order,
                  "let a Step that is additive in dt to this order only pass (2: Euler)")
      ->option_text("N")
      ->check(CLI::Range(1, 8));
  command.footer(kFooter);
  command.callback([&action, arguments] { action = [arguments] { return Check(*arguments); }; });
}

}  // namespace alidade::cli
