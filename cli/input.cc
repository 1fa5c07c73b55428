// SPDX-License-Identifier: Apache-2.0
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <charconv>
#include <cstdio>
#include <new>
#include <set>

#include "alidade/experiment/calibration.h"
#include "alidade/io/output_folder.h"
#include "alidade/plugin/plugin_folders.h"
#include "command.h"
#include "console.h"

namespace alidade::cli {
namespace fs = std::filesystem;
namespace {

std::string IsAssignment(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals != text.npos && equals > 0) return {};
  return "'" + text + "' is not an assignment; expected key=value, as in source.seed=7";
}

/// Returns the absolute path without `.`, `..` and repeated slashes.
fs::path FullPath(const fs::path& path) {
  std::error_code error;
  const fs::path full = fs::absolute(path, error).lexically_normal();
  if (!error) return full;
  if (error == std::errc::not_enough_memory) throw std::bad_alloc();
  throw Error(ExitCode::kCannotCreate,
              ErrorLine(Place{path.string()}, {},
                        "the current folder no longer exists; change to an existing folder, or "
                        "use full paths"));
}

/// Returns the default name of an output folder: the name of the config's folder if the file is
/// called config.yaml, else the stem of the file.
std::string DefaultOutputName(const fs::path& config) {
  const std::string folder = FullPath(config).parent_path().filename().string();
  const bool by_folder = config.filename() == "config.yaml" && !folder.empty();
  return by_folder ? folder : config.stem().string();
}

constexpr const char* kRuns = "runs";

/// Returns true if `folder` is runs/ itself, which contains all runs. --force would delete all of
/// them.
bool IsRunsFolder(const fs::path& folder) {
  std::error_code error;
  const fs::path runs = fs::absolute(kRuns, error) / "";
  return !error && FullPath(folder / "") == runs;
}

}  // namespace

std::function<std::string(const std::string&)> IsInteger(std::int64_t minimum,
                                                         std::int64_t maximum) {
  return [minimum, maximum](const std::string& text) -> std::string {
    std::int64_t value = 0;
    const char* const end = text.data() + text.size();
    const auto [parsed_end, error] = std::from_chars(text.data(), end, value);
    const bool is_integer = error == std::errc() && parsed_end == end;
    // CLI11 parses the text later with the rules of C, so 010 would mean 8.
    const std::size_t first = text.starts_with('-') ? 1 : 0;
    if (is_integer && text.size() > first + 1 && text[first] == '0')
      return "'" + text + "' has a leading zero; expected a number without leading zeros";
    if (is_integer && value >= minimum && value <= maximum) return {};
    return "'" + text + "' is not an integer from " + std::to_string(minimum) + " to " +
           std::to_string(maximum);
  };
}

std::function<std::string(const std::string&)> IsNumber(double minimum, double maximum) {
  return [minimum, maximum](const std::string& text) -> std::string {
    double value = 0.0;
    const char* const end = text.data() + text.size();
    const auto [parsed_end, error] = std::from_chars(text.data(), end, value);
    if (error == std::errc() && parsed_end == end && value >= minimum && value <= maximum)
      return {};
    char range[64];
    std::snprintf(range, sizeof range, "%g to %g", minimum, maximum);
    return "'" + text + "' is not a number from " + range;
  };
}

std::string IsNonEmpty(const std::string& path) { return path.empty() ? "the path is empty" : ""; }

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
      ->check(IsNonEmpty);
}

void AddOutput(CLI::App& command, std::string& folder, const std::string& help) {
  command.add_option("-o,--output", folder, help)->option_text("DIR")->check(IsNonEmpty);
}

CLI::Option* AddSeed(CLI::App& command, std::optional<std::uint64_t>& seed) {
  return command.add_option("--seed", seed, "seed of the source; replaces the seed in the config")
      ->option_text("N")
      ->check(IsInteger(0, INT64_MAX));
}

void Input::AddTo(CLI::App& command) {
  command.add_option("CONFIG", config, "the config file (YAML)")
      ->option_text(" ")
      ->required()
      ->check(IsNonEmpty);
  AddSets(command, sets, "set a key of the config, such as source.seed=7; may be repeated");
  AddPluginPath(command, plugin_paths);
  command.add_flag("--allow-outside", allow_outside,
                   "allow paths in `include:` and `output:` that lead out of their folders");
  command.add_option("--recorded-set", recorded_sets, "for `alidade replay`")->group("");
}

Config Input::Load() const {
  Config loaded = Config::FromFile(config, allow_outside);
  for (const std::string& set : sets) {
    const std::size_t equals = set.find('=');
    loaded.Set(set.substr(0, equals), set.substr(equals + 1), "--set");
  }
  return internal::WithCameraFiles(loaded);
}

std::vector<fs::path> Absolute(const std::vector<std::string>& paths) {
  std::vector<fs::path> absolute;
  for (const std::string& path : paths) absolute.push_back(FullPath(path));
  return absolute;
}

namespace {

/// Returns the plugin paths that the config and the command line name.
std::vector<fs::path> PluginPathsOf(const Input& input, const Config& loaded) {
  std::vector<fs::path> places;
  for (const fs::path& path : PluginPaths(loaded)) places.push_back(FullPath(path));
  for (const fs::path& path : Absolute(input.plugin_paths)) places.push_back(path);
  return places;
}

}  // namespace

PluginHost Input::Host(const Config& loaded) const {
  return PluginHost(PluginPathsOf(*this, loaded));
}

PluginHost Input::HostFor(const Config& loaded, const std::vector<Config>& other_configs) const {
  std::set<std::string> names = KeysAndScalarsOf(loaded);
  for (const Config& other_config : other_configs) names.merge(KeysAndScalarsOf(other_config));
  return PluginHost(PluginPathsOf(*this, loaded), OnRefusal::kThrow, names);
}

std::string Input::InputsText(const Config& loaded, const std::vector<std::string>& arguments,
                              const std::vector<Config>& runs,
                              const internal::PluginHashes& plugins) const {
  internal::CommandInputs command{arguments,
                                  recorded_sets.empty() ? sets : recorded_sets,
                                  {},
                                  internal::PluginFoldersOfEnvironment()};
  for (const fs::path& path : Absolute(plugin_paths)) {
    if (std::ranges::find(command.plugin_paths, path) == command.plugin_paths.end())
      command.plugin_paths.push_back(path);
  }
  return internal::InputsJson(command, loaded, runs, plugins);
}

void ReportStopped(std::size_t done, std::int64_t runs, const std::string& more) {
  PrintNote("stopped after " + std::to_string(done) + " of " + std::to_string(runs) + " runs" +
            more);
}

fs::path Resolved(const std::string& path) {
  std::error_code error;
  const fs::path absolute = fs::absolute(path, error);
  fs::path resolved = fs::weakly_canonical(absolute, error);
  return error ? absolute.lexically_normal() : resolved;
}

void ProtectInputs(const std::string& output, const std::vector<std::string>& inputs) {
  if (output.empty()) return;
  const fs::path destination = Resolved(output), partial = internal::PartialOf(destination);
  const auto is_inside = [](const fs::path& path, const fs::path& folder) {
    return std::ranges::mismatch(folder, path).in1 == folder.end();
  };
  for (const std::string& input : inputs) {
    const fs::path path = input.empty() ? fs::path() : Resolved(input);
    if (!is_inside(path, destination) && !is_inside(path, partial)) continue;
    throw Error(ExitCode::kCannotCreate,
                ErrorLine(Place{output}, {},
                          std::string("the folder ") + (path == destination ? "is" : "contains") +
                              " the input '" + input + "'",
                          "another folder"));
  }
}

namespace {

fs::path PreferredFolder(const std::string& requested, const Config& config, const Input& input,
                         const std::string& prefix) {
  constexpr const char* kIsRunsFolder = "is the folder that contains all runs";
  if (!requested.empty()) {
    if (!IsRunsFolder(requested)) return requested;
    throw Error(ExitCode::kCannotCreate,
                ErrorLine(Place{requested}, {}, std::string("this ") + kIsRunsFolder, "runs/NAME"));
  }
  if (const auto output = config.root().Find("output")) {
    const std::string name = output->Text();
    if (name.empty()) output->Fail("the path is empty", "a name inside runs/");
    FullPath(name);  // throws if the current folder no longer exists
    const fs::path folder =
        ResolveInside(kRuns, name, input.allow_outside, output->place(), output->path());
    if (IsRunsFolder(folder))
      output->Fail("'" + name + "' " + kIsRunsFolder, "a name inside runs/");
    return folder;
  }
  return fs::path(kRuns) / (prefix + DefaultOutputName(input.config));
}

/// Returns the first free folder of FOLDER, FOLDER-2, FOLDER-3, ... A folder is free if neither the
/// folder nor its `.partial` folder exists.
fs::path FreeFolder(const fs::path& folder) {
  const auto exists = [](const fs::path& path) {
    std::error_code error;
    return fs::exists(fs::symlink_status(path, error)) ||
           fs::exists(fs::symlink_status(internal::PartialOf(path), error));
  };
  fs::path free = folder;
  for (int n = 2; exists(free); ++n) free = folder.string() + '-' + std::to_string(n);
  return free;
}

}  // namespace

Output OutputFolder(const std::string& requested, const Config& config, const Input& input,
                    bool force, const std::string& prefix) {
  const fs::path preferred = PreferredFolder(requested, config, input, prefix);
  FullPath(preferred);  // throws if the current folder no longer exists
  const fs::path folder = requested.empty() && !force ? FreeFolder(preferred) : preferred;
  ProtectInputs(folder.string(), config.inputs());
  return {folder, preferred};
}

void ReportOutput(const Output& output) {
  if (output.folder == output.preferred) return;
  std::error_code error;
  const bool exists = fs::exists(fs::symlink_status(output.preferred, error));
  const fs::path existing = exists ? output.preferred : internal::PartialOf(output.preferred);
  PrintNote(existing.string() + " exists: the output is " + output.folder.string() +
            " (--force replaces " + existing.string() + ')');
}

}  // namespace alidade::cli
