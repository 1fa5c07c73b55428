// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/App.hpp>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/experiment/run.h"
#include "alidade/plugin/plugin_host.h"
#include "alidade/replay/run_inputs.h"

/// The commands of the program. Each one reads its arguments, calls core and prints.
namespace alidade::cli {

/// Action of a command after its arguments have been parsed. Returns the exit code.
using Action = std::function<ExitCode()>;

/// Adds the command `run`. The record of the run contains `command_line`.
void AddRun(CLI::App& program, Action& action, const std::string& command_line);
void AddExplain(CLI::App& program, Action& action);
void AddCompare(CLI::App& program, Action& action, const std::string& command_line);
void AddSweep(CLI::App& program, Action& action);
void AddMerge(CLI::App& program, Action& action);
/// `execute` runs a command from its arguments, without the name of the program.
void AddReplay(CLI::App& program, Action& action,
               const std::function<ExitCode(const std::vector<std::string>&)>& execute);
void AddBundle(CLI::App& program, Action& action);
void AddSimulate(CLI::App& program, Action& action);
void AddPlugins(CLI::App& program, Action& action);
void AddCheck(CLI::App& program, Action& action);
void AddEval(CLI::App& program, Action& action);
void AddDoctor(CLI::App& program, Action& action);

/// Arguments that name a config and the plugins it needs.
struct Input {
  std::string config;
  std::vector<std::string> sets;  ///< `key=value`, applied in order
  std::vector<std::string> plugin_paths;
  bool allow_outside = false;

  void AddTo(CLI::App& command);
  Config Load() const;
  /// Returns the host of the plugins in the paths of `config` and of the command line, and in the
  /// default folders.
  PluginHost Host(const Config& config) const;
  /// Like Host, but ignores plugins of the default folders that neither `config` nor
  /// `other_configs` need.
  PluginHost HostFor(const Config& config, const std::vector<Config>& other_configs = {}) const;
  /// Returns the text of inputs.json for a command with these arguments (internal::CommandInputs).
  /// `runs` are the configs of its runs, `plugins` are the plugins that these use.
  std::string InputsText(const Config& config, const std::vector<std::string>& arguments,
                         const std::vector<Config>& runs,
                         const internal::PluginHashes& plugins) const;
};

void AddPluginPath(CLI::App& command, std::vector<std::string>& paths);
/// Adds the option --set. `help` is its help text.
void AddSets(CLI::App& command, std::vector<std::string>& sets, const std::string& help);
/// Validator of CLI11: rejects an empty path.
std::string IsNonEmpty(const std::string& path);
/// Adds the option -o, a folder. `folder` is "" if the option is absent.
void AddOutput(CLI::App& command, std::string& folder, const std::string& help);
/// Adds the option --seed.
CLI::Option* AddSeed(CLI::App& command, std::optional<std::uint64_t>& seed);
std::vector<std::filesystem::path> Absolute(const std::vector<std::string>& paths);

/// Returns a validator of an option. It returns an error text, or "" if the value is in
/// [minimum, maximum].
std::function<std::string(const std::string&)> IsInteger(std::int64_t minimum,
                                                         std::int64_t maximum);
std::function<std::string(const std::string&)> IsNumber(double minimum, double maximum);

/// Prints that a sweep was stopped after `done` of `runs` runs, followed by `more`.
void ReportStopped(std::size_t done, std::int64_t runs, const std::string& more = "");

/// Returns the absolute path with links resolved as far as possible. Two names of one file have the
/// same result.
std::filesystem::path Resolved(const std::string& path);

/// Rejects an output folder if it or its `.partial` is or contains an input of the command, because
/// --force would delete the input. Paths may be empty. Error: kCannotCreate.
void ProtectInputs(const std::string& output, const std::vector<std::string>& inputs);

/// Output folder of a command. `preferred` is the folder that is used if it does not exist yet.
struct Output {
  std::filesystem::path folder, preferred;
};
/// Chooses the output folder. `preferred` is `requested`, else the config's `output:` inside runs/,
/// else runs/PREFIX and the name of the config. That name is the folder's name if the file is
/// called config.yaml, else the file's stem. If `requested` is empty, `force` is false, and the
/// preferred folder or its `.partial` exists, the function chooses the first of NAME-2, NAME-3, ...
/// for which neither exists.
/// Errors: kCannotCreate if `requested` is runs/ itself, or if the output would replace the config
/// or its inputs; kNotTrusted, kBadConfig.
Output OutputFolder(const std::string& requested, const Config& config, const Input& input,
                    bool force, const std::string& prefix = "");
/// Prints a note if the output folder is not the preferred one. To be called after the config has
/// been validated.
void ReportOutput(const Output& output);

}  // namespace alidade::cli
