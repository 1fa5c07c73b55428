// SPDX-License-Identifier: Apache-2.0
#include "alidade/check/check.h"

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "alidade/experiment/calibration.h"
#include "alidade/plugin/built_in_models.h"
#include "command.h"
#include "console.h"

namespace alidade::cli {
namespace fs = std::filesystem;
namespace {

constexpr const char* kCheckFooter = R"(Examples:
  alidade check build/alidade_range_rate.so --set sigma_m_s=0.5
  alidade check constant_velocity --set noise.acceleration=1
  alidade check mine.so radar --set sigma_m_s=0.5 --states 500 --seed 7
  alidade check stereo_disparity --config examples/05_depth_principled/config.yaml

Each check prints one line: ok, FAIL or skipped, and the observation. If a plugin crashes, exits,
hangs or uses too much memory, only the current check fails. Exit code 1: a check failed; 78: a
parameter is missing or wrong. For a plugin with several models, use `--set MODEL.key=value`.)";

struct CheckArguments {
  std::string plugin, model, config;
  std::vector<std::string> sets, plugin_paths;
  CheckOptions options;
};

bool IsFile(const std::string& plugin) {
  return plugin.find('/') != plugin.npos || plugin.ends_with(".so");
}

/// Returns the parameters of the model `entry` that the command line sets.
Config Parameters(const CheckArguments& arguments, const PluginEntry& entry, bool is_only_model) {
  Config config = Config::FromText("{}", entry.name);
  for (const std::string& set : arguments.sets) {
    const std::string prefix = is_only_model ? "" : entry.name + '.';
    const std::size_t equals = set.find('=');
    const std::string key = set.substr(0, equals);
    if (!key.starts_with(prefix)) continue;
    config.Set(key.substr(prefix.size()), set.substr(equals + 1), "--set");
  }
  return config;
}

/// Rejects a `--set` that does not name a model, if there are several models.
void RequireModels(const CheckArguments& arguments, const std::vector<PluginEntry>& entries) {
  for (const std::string& set : arguments.sets) {
    const auto names_model = [&](const PluginEntry& entry) {
      return set.starts_with(entry.name + '.');
    };
    if (entries.size() == 1 || std::any_of(entries.begin(), entries.end(), names_model)) continue;
    throw Error(ExitCode::kBadConfig,
                ErrorLine({"--set"}, set.substr(0, set.find('=')), "the model is missing",
                          "MODEL.key=value or the argument MODEL for a plugin of several models"));
  }
}

/// Checks a model with the given parameters, and prints the findings and their number. Returns true
/// if a check failed.
bool CheckAndPrint(const PluginEntry& entry, const Node& parameters, const CheckOptions& options) {
  const auto findings = CheckModel(entry, parameters, options);
  const std::string prefix = parameters.path().empty() ? "" : parameters.path() + ": ";
  PrintText(prefix + CheckText(entry, findings));
  return AnyFailure(findings);
}

/// Returns the lines of an error. Replaces each place in the parameters by `model 'NAME'`, because
/// these parameters are not in a file.
std::string NameModelInErrors(const std::string& name, const std::string& lines) {
  const std::string placeholder = name + ":1:1 ";
  std::string text;
  for (std::size_t offset = 0; offset < lines.size();) {
    const std::size_t end = std::min(lines.find('\n', offset), lines.size());
    const std::string line = lines.substr(offset, end - offset);
    if (offset > 0) text += '\n';
    text += line.starts_with(placeholder)
                ? "model '" + name + "': " + line.substr(placeholder.size())
                : line;
    offset = end + 1;
  }
  return text;
}

/// Checks the models with the parameters that the command line sets. Returns true if a check
/// failed.
bool CheckAllAndPrint(const std::vector<PluginEntry>& entries, const CheckArguments& arguments) {
  RequireModels(arguments, entries);
  bool failed = false;
  for (const PluginEntry& entry : entries) {
    const Config parameters = Parameters(arguments, entry, entries.size() == 1);
    try {
      failed = CheckAndPrint(entry, parameters.root(), arguments.options) || failed;
    } catch (const Error& e) {
      if (e.code() != ExitCode::kBadConfig) throw;
      throw Error(e.code(), NameModelInErrors(entry.name, e.what()) +
                                "\n  to set a parameter, use --set " +
                                (entries.size() == 1 ? "" : entry.name + '.') + "KEY=VALUE");
    }
  }
  return failed;
}

/// Checks the models with the parameters in the config of a run. Returns true if a check failed.
bool CheckAllAndPrint(const std::vector<PluginEntry>& entries, const Config& config,
                      CheckOptions options) {
  options.allows_unread_keys = true;
  bool failed = false, found = false;
  constexpr std::pair<const char*, const char*> kSections[] = {{"state", kMotionKind},
                                                               {"sensors", kSensorKind}};
  for (const auto& [section, kind] : kSections) {
    const auto map = config.root().Find(section);
    if (!map) continue;
    for (const auto& [name, node] : map->Entries()) {
      const auto model = node.Find("model");
      for (const PluginEntry& entry : entries) {
        if (!model || model->Text() != entry.name || entry.kind != kind) continue;
        failed = CheckAndPrint(entry, node, options) || failed;
        found = true;
      }
    }
  }
  if (!found) {
    std::string models;
    for (const PluginEntry& entry : entries) models += (models.empty() ? "" : ", ") + entry.name;
    config.root().Fail("no entry of `state` or `sensors` uses a model of the plugin",
                       "an entry with model: " + models);
  }
  return failed;
}

/// Checks the models whose equations are in the config of a run, and prints the findings. Returns
/// true if a check failed.
bool CheckConfigModelsAndPrint(const Config& config, const PluginHost& host,
                               const std::string& model, const CheckOptions& options) {
  bool failed = false;
  for (const ConfigModelCheck& check : CheckConfigModels(config, host, model, options)) {
    PrintText(check.path + ": " + CheckText(check.entry, check.findings));
    failed = AnyFailure(check.findings) || failed;
  }
  return failed;
}

ExitCode Check(const CheckArguments& arguments) {
  std::optional<Config> config;
  std::vector<fs::path> places;
  if (IsFile(arguments.plugin)) places = Absolute({arguments.plugin});
  if (!arguments.config.empty()) {
    config = internal::WithCameraFiles(Config::FromFile(arguments.config));
    for (const fs::path& path : PluginPaths(*config)) places.push_back(fs::absolute(path));
  }
  for (const fs::path& path : Absolute(arguments.plugin_paths)) places.push_back(path);
  const PluginHost host(places);
  if (internal::HasEquationsInConfig(arguments.plugin)) {
    if (!config) {
      throw Error(
          ExitCode::kUsage,
          ErrorLine({}, {}, "the equations of the model " + arguments.plugin + " are in a config",
                    "--config FILE"));
    }
    const bool failed =
        CheckConfigModelsAndPrint(*config, host, arguments.plugin, arguments.options);
    return failed ? ExitCode::kFound : ExitCode::kOk;
  }
  const auto entries = FindModels(host, arguments.plugin, arguments.model);
  const bool failed = config ? CheckAllAndPrint(entries, *config, arguments.options)
                             : CheckAllAndPrint(entries, arguments);
  return failed ? ExitCode::kFound : ExitCode::kOk;
}

}  // namespace

void AddCheck(CLI::App& program, Action& action) {
  CLI::App& command = *program.add_subcommand(
      "check", "Check that the models of a plugin follow the rules for models");
  const auto arguments = std::make_shared<CheckArguments>();
  CheckOptions& options = arguments->options;
  command
      .add_option("PLUGIN", arguments->plugin, "a plugin file, or the name of a plugin or model")
      ->option_text(" ")
      ->required()
      ->check(IsNonEmpty);
  command.add_option("MODEL", arguments->model, "check this model only")->option_text(" ");
  AddSets(command, arguments->sets, "set a parameter of the model; may be repeated");
  command.add_option("--config", arguments->config, "read the parameters from the config of a run")
      ->option_text("FILE")
      ->check(IsNonEmpty)
      ->excludes("--set");
  AddPluginPath(command, arguments->plugin_paths);
  command.add_option("--seed", options.seed, "seed of the random states; default 1")
      ->option_text("N");
  command.add_option("--states", options.states, "number of random states; default 48")
      ->option_text("N")
      ->check(IsInteger(1, 1'000'000));
  command
      .add_option("--timeout", options.timeout_s, "time limit of each check in seconds; default 10")
      ->option_text("S")
      ->check(IsNumber(0.01, 1e6));
  command.add_option("--memory", options.memory_mb, "memory limit of a model in MB; default 1024")
      ->option_text("MB")
      ->check(IsInteger(16, 1 << 30));
  command
      .add_option(
          "--step-order", options.step_order,
          "order in dt to which Step must be additive (2 for Euler steps); default: the order "
          "that the model declares")
      ->option_text("N")
      ->check(IsInteger(1, 8));
  command.footer(kCheckFooter);
  command.callback([&action, arguments] { action = [arguments] { return Check(*arguments); }; });
}

}  // namespace alidade::cli
