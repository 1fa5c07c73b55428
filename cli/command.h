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

/// Commands of the program. Each command reads its arguments, calls the library and prints the
/// results.
namespace alidade::cli {

/// Action of a command after its arguments have been parsed. Returns the exit code.
using Action = std::function<ExitCode()>;

/// Adds the command `run`. The record of a run contains `command_line`.
void AddRun(CLI::App& program, Action& action, const std::string& command_line);
void AddExplain(CLI::App& program, Action& action);
void AddCompare(CLI::App& program, Action& action, const std::string& command_line);
/// Adds the command `sweep`. A stopped sweep prints `command_line` with the option --resume.
void AddSweep(CLI::App& program, Action& action, const std::string& command_line);
void AddMerge(CLI::App& program, Action& action);
/// Adds the command `replay`. `execute` runs a command; its argument is the command line without
/// the name of the program.
void AddReplay(CLI::App& program, Action& action,
               const std::function<ExitCode(const std::vector<std::string>&)>& execute);
void AddBundle(CLI::App& program, Action& action);
void AddSimulate(CLI::App& program, Action& action);
void AddPlugins(CLI::App& program, Action& action);
void AddCheck(CLI::App& program, Action& action);
void AddEval(CLI::App& program, Action& action);
void AddDiagnose(CLI::App& program, Action& action);
void AddReport(CLI::App& program, Action& action);
void AddDoctor(CLI::App& program, Action& action);

/// Arguments that name a config and the plugins that the config needs.
struct Input {
  std::string config;
  std::vector<std::string> sets;  ///< assignments `key=value`, applied in this order
  std::vector<std::string> plugin_paths;
  bool allow_outside = false;
  /// The assignments that inputs.json records instead of `sets`: those of a run that is repeated.
  std::vector<std::string> recorded_sets = {};

  void AddTo(CLI::App& command);
  Config Load() const;
  /// Returns a host of all plugins in the default folders and in the paths that `config` and the
  /// command line name.
  PluginHost Host(const Config& config) const;
  /// Returns a host like Host(), but without the plugins of the default folders that neither
  /// `config` nor `other_configs` need.
  PluginHost HostFor(const Config& config, const std::vector<Config>& other_configs = {}) const;
  /// Returns the text of inputs.json for a command with these arguments (internal::CommandInputs).
  /// `runs` are the configs of the command's runs. `plugins` are the hashes of the plugins that
  /// these configs use.
  std::string InputsText(const Config& config, const std::vector<std::string>& arguments,
                         const std::vector<Config>& runs,
                         const internal::PluginHashes& plugins) const;
};

void AddPluginPath(CLI::App& command, std::vector<std::string>& paths);
/// Adds the option --set. `help` is its help text.
void AddSets(CLI::App& command, std::vector<std::string>& sets, const std::string& help);
/// Validates an option for CLI11: returns an error text if the path is empty, else "".
std::string IsNonEmpty(const std::string& path);
/// Adds the option -o, which names a folder. `folder` is "" if the option is absent.
void AddOutput(CLI::App& command, std::string& folder, const std::string& help);
/// Adds the option --seed.
CLI::Option* AddSeed(CLI::App& command, std::optional<std::uint64_t>& seed);
std::vector<std::filesystem::path> Absolute(const std::vector<std::string>& paths);

/// Returns a validator of an option for CLI11. The validator returns "" if the value is in
/// [minimum, maximum], else an error text.
std::function<std::string(const std::string&)> IsInteger(std::int64_t minimum,
                                                         std::int64_t maximum);
std::function<std::string(const std::string&)> IsNumber(double minimum, double maximum);

/// Prints that a sweep was stopped after `done` of `runs` runs. Appends `more` to this message.
void ReportStopped(std::size_t done, std::int64_t runs, const std::string& more = "");

/// Returns the absolute path, with links resolved as far as possible. All names of one file yield
/// the same path.
std::filesystem::path Resolved(const std::string& path);

/// Rejects an output folder if this folder or its `.partial` folder is or contains an input of the
/// command, because --force would delete the input. Paths may be empty. Error: kCannotCreate.
void ProtectInputs(const std::string& output, const std::vector<std::string>& inputs);

/// Output folder of a command. `preferred` is the folder that the command uses if this folder does
/// not exist yet.
struct Output {
  std::filesystem::path folder, preferred;
};
/// Chooses the output folder. The preferred folder is `requested`. If `requested` is empty, the
/// preferred folder is the config's `output:` inside runs/. If both are missing, the preferred
/// folder is in runs/, and its name is `prefix` followed by the name of the config: the name of the
/// config's folder if the file is called config.yaml, else the stem of the file. If `requested` is
/// empty and `force` is false, an existing folder is not replaced: if FOLDER or FOLDER.partial
/// exists, the function chooses the first of FOLDER-2, FOLDER-3, ... for which neither exists.
/// Errors: kCannotCreate if `requested` is runs/ itself, or if the output would replace the config
/// or its inputs; kNotTrusted, kBadConfig.
Output OutputFolder(const std::string& requested, const Config& config, const Input& input,
                    bool force, const std::string& prefix = "");
/// Prints a note if the output folder is not the preferred one. Must be called after the config was
/// validated.
void ReportOutput(const Output& output);

}  // namespace alidade::cli
