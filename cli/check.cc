// SPDX-License-Identifier: Apache-2.0
#include "alidade/check/check.h"

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

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

Each check is a line: ok, FAIL or skipped, and what was seen. A plugin that crashes, ends the
process, hangs or eats memory ends nothing but its check. Exits with 1 where a line says FAIL, 78
where a parameter is missing or wrong. Of a plugin with several models, `--set MODEL.key=value`.)";

struct CheckArguments {
  std::string plugin, model, config;
  std::vector<std::string> sets, plugin_paths;
  CheckOptions options;
};

bool IsFile(const std::string& plugin) {
  return plugin.find('/') != plugin.npos || plugin.ends_with(".so");
}

/// The parameters that the command line gives the model `entry`, which is the only one or not.
Config Parameters(const CheckArguments& arguments, const PluginEntry& entry, bool only) {
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
void RequireModels(const CheckArguments& arguments, const std::vector<PluginEntry>& entries) {
  for (const std::string& set : arguments.sets) {
    const auto is_of = [&](const PluginEntry& entry) { return set.starts_with(entry.name + '.'); };
    if (entries.size() == 1 || std::any_of(entries.begin(), entries.end(), is_of)) continue;
    throw Error(ExitCode::kBadConfig,
                ErrorLine({"--set"}, set.substr(0, set.find('=')), "of which model?",
                          "MODEL.key=value, as the plugin has several; or name the MODEL"));
  }
}

/// Whether a model failed with these parameters; prints its findings.
bool Fails(const PluginEntry& entry, const Node& parameters, const CheckOptions& options) {
  const auto findings = CheckModel(entry, parameters, options);
  const std::string from = parameters.path().empty() ? "" : parameters.path() + ": ";
  Print(from + CheckText(entry, findings));
  return AnyFailure(findings);
}

/// The lines of an error, `model 'NAME'` in front in place of where the text of its parameters,
/// which is in no file, would have the fault.
std::string OfModel(const std::string& name, const std::string& lines) {
  const std::string nowhere = name + ":1:1 ";
  std::string text;
  for (std::size_t at = 0; at < lines.size();) {
    const std::size_t end = std::min(lines.find('\n', at), lines.size());
    const std::string line = lines.substr(at, end - at);
    if (at > 0) text += '\n';
    text +=
        line.starts_with(nowhere) ? "model '" + name + "': " + line.substr(nowhere.size()) : line;
    at = end + 1;
  }
  return text;
}

/// The models as the command line sets them.
bool AnyFails(const std::vector<PluginEntry>& entries, const CheckArguments& arguments) {
  RequireModels(arguments, entries);
  bool failed = false;
  for (const PluginEntry& entry : entries) {
    const Config parameters = Parameters(arguments, entry, entries.size() == 1);
    try {
      failed = Fails(entry, parameters.root(), arguments.options) || failed;
    } catch (const Error& e) {
      if (e.code() != ExitCode::kBadConfig) throw;
      throw Error(e.code(), OfModel(entry.name, e.what()) + "\n  parameters are given with --set " +
                                (entries.size() == 1 ? "" : entry.name + '.') + "KEY=VALUE");
    }
  }
  return failed;
}

/// The models as the entries of a run's config set them.
bool AnyFails(const std::vector<PluginEntry>& entries, const Config& config, CheckOptions options) {
  options.other_keys = true;
  bool failed = false, any = false;
  constexpr std::pair<const char*, const char*> kSections[] = {{"state", kMotionKind},
                                                               {"sensors", kSensorKind}};
  for (const auto& [section, kind] : kSections) {
    const auto map = config.root().Find(section);
    if (!map) continue;
    for (const auto& [name, node] : map->Entries()) {
      const auto model = node.Find("model");
      for (const PluginEntry& entry : entries) {
        if (!model || model->Text() != entry.name || entry.kind != kind) continue;
        failed = Fails(entry, node, options) || failed;
        any = true;
      }
    }
  }
  if (!any) {
    std::string models;
    for (const PluginEntry& entry : entries) models += (models.empty() ? "" : ", ") + entry.name;
    config.root().Fail("no entry of `state` and `sensors` has a model of the plugin",
                       "one with model: " + models);
  }
  return failed;
}

ExitCode Check(const CheckArguments& arguments) {
  std::optional<Config> config;
  std::vector<fs::path> places;
  if (IsFile(arguments.plugin)) places = Absolute({arguments.plugin});
  if (!arguments.config.empty()) {
    config = Config::FromFile(arguments.config);
    for (const fs::path& path : PluginPaths(*config)) places.push_back(fs::absolute(path));
  }
  for (const fs::path& path : Absolute(arguments.plugin_paths)) places.push_back(path);
  const PluginHost host(places);
  const auto entries = FindModels(host, arguments.plugin, arguments.model);
  const bool failed =
      config ? AnyFails(entries, *config, arguments.options) : AnyFails(entries, arguments);
  return failed ? ExitCode::kFound : ExitCode::kOk;
}

}  // namespace

void AddCheck(CLI::App& program, Action& action) {
  CLI::App& command =
      *program.add_subcommand("check", "Check that the models of a plugin keep the rules");
  const auto arguments = std::make_shared<CheckArguments>();
  CheckOptions& options = arguments->options;
  command
      .add_option("PLUGIN", arguments->plugin, "a plugin file, or the name of one or of a model")
      ->option_text(" ")
      ->required()
      ->check(IsNamed);
  command.add_option("MODEL", arguments->model, "of its models, this one")->option_text(" ");
  AddSets(command, arguments->sets, "set a parameter of the model; may be repeated");
  command.add_option("--config", arguments->config, "take the parameters from the config of a run")
      ->option_text("FILE")
      ->check(IsNamed)
      ->excludes("--set");
  AddPluginPath(command, arguments->plugin_paths);
  command.add_option("--seed", options.seed, "of the random states; default 1")->option_text("N");
  command.add_option("--states", options.states, "number of random states; default 48")
      ->option_text("N")
      ->check(IsInteger(1, 1'000'000));
  command.add_option("--timeout", options.timeout_s, "of each check, in seconds; default 10")
      ->option_text("S")
      ->check(IsNumber(0.01, 1e6));
  command.add_option("--memory", options.memory_mb, "that a model may take, in MB; default 1024")
      ->option_text("MB")
      ->check(IsInteger(16, 1 << 30));
  command
      .add_option(
          "--step-order", options.step_order,
          "let a Step that is additive in dt to this order only pass (2: Euler); default the "
          "order that the model declares")
      ->option_text("N")
      ->check(IsInteger(1, 8));
  command.footer(kCheckFooter);
  command.callback([&action, arguments] { action = [arguments] { return Check(*arguments); }; });
}

}  // namespace alidade::cli
