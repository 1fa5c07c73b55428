// SPDX-License-Identifier: Apache-2.0
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include "command.h"

namespace alidade::cli {
namespace fs = std::filesystem;
namespace {

std::string IsAssignment(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals != text.npos && equals > 0) return {};
  return "'" + text + "' is no assignment; expected key=value, as in source.seed=7";
}

std::string NameOf(const fs::path& config) {
  const std::string folder = config.parent_path().lexically_normal().filename().string();
  const bool named = !folder.empty() && folder != "." && folder != "..";
  return named ? folder : config.stem().string();
}

}  // namespace

std::string IsNamed(const std::string& path) { return path.empty() ? "empty path" : ""; }

void AddSets(CLI::App& command, std::vector<std::string>& sets, const std::string& help) {
  command.add_option("--set", sets, help)
      ->option_text("KEY=VALUE")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false)
      ->check(IsAssignment);
}

void AddPluginPath(CLI::App& command, std::vector<std::string>& paths) {
  command.add_option("--plugin-path", paths, "a plugin, or a folder of plugins; may be repeated")
      ->option_text("PATH")
      ->type_name("PATH")
      ->allow_extra_args(false)
      ->check(IsNamed);
}

void AddOutput(CLI::App& command, std::string& folder, const std::string& help) {
  command.add_option("-o,--output", folder, help)->option_text("DIR")->check(IsNamed);
}

void Input::AddTo(CLI::App& command) {
  command.add_option("CONFIG", config, "the config, a YAML file")
      ->option_text(" ")
      ->required()
      ->check(IsNamed);
  AddSets(command, sets, "set a key of the config, in dotted form; may be repeated");
  AddPluginPath(command, plugin_paths);
  command.add_flag("--allow-outside", allow_outside,
                   "let `include:` and `output:` of the config leave their folders");
}

Config Input::Load() const {
  Config loaded = Config::FromFile(config, allow_outside);
  for (const std::string& set : sets) {
    const std::size_t equals = set.find('=');
    loaded.Set(set.substr(0, equals), set.substr(equals + 1), "--set");
  }
  return loaded;
}

std::vector<fs::path> Absolute(const std::vector<std::string>& paths) {
  std::vector<fs::path> absolute;
  for (const std::string& path : paths) absolute.push_back(fs::absolute(path).lexically_normal());
  return absolute;
}

PluginHost Input::Host(const Config& loaded) const {
  std::vector<fs::path> places;
  for (const fs::path& path : PluginPaths(loaded)) places.push_back(fs::absolute(path));
  for (const fs::path& path : Absolute(plugin_paths)) places.push_back(path);
  return PluginHost(places);
}

fs::path OutputFolder(const std::string& given, const Config& config, const Input& input,
                      const std::string& prefix) {
  if (!given.empty()) return given;
  if (const auto output = config.root().Find("output")) {
    return ResolveInside("runs", output->Text(), input.allow_outside, output->place(),
                         output->path());
  }
  return fs::path("runs") / (prefix + NameOf(input.config));
}

}  // namespace alidade::cli
