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

/// What a command does once the command line has been read; gives the exit code.
using Action = std::function<ExitCode()>;

/// `command_line` is what the record of the run shows.
void AddRun(CLI::App& program, Action& action, const std::string& command_line);
void AddExplain(CLI::App& program, Action& action);
void AddCompare(CLI::App& program, Action& action, const std::string& command_line);
void AddSweep(CLI::App& program, Action& action);
void AddMerge(CLI::App& program, Action& action);
/// `execute` runs a command: its words, without the name of the program.
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
  /// The plugins that `config` and the command line name, then the usual places.
  PluginHost Host(const Config& config) const;
  /// Of the usual places those alone that `config`, or one of `others`, may need.
  PluginHost HostFor(const Config& config, const std::vector<Config>& others = {}) const;
  /// The text of inputs.json for a command with these arguments, as internal::CommandInputs has
  /// them; `runs` are the configs of its runs, `plugins` those that they use.
  std::string InputsText(const Config& config, const std::vector<std::string>& arguments,
                         const std::vector<Config>& runs,
                         const internal::PluginHashes& plugins) const;
};

void AddPluginPath(CLI::App& command, std::vector<std::string>& paths);
/// The option --set; `help` says what it sets.
void AddSets(CLI::App& command, std::vector<std::string>& sets, const std::string& help);
/// A validator of CLI11: the path is not empty.
std::string IsNamed(const std::string& path);
/// The option -o, a folder; "" where it is not given.
void AddOutput(CLI::App& command, std::string& folder, const std::string& help);
/// The option --seed.
CLI::Option* AddSeed(CLI::App& command, std::optional<std::uint64_t>& seed);
std::vector<std::filesystem::path> Absolute(const std::vector<std::string>& paths);

/// A check of an option: says what is wrong with its text, or "".
std::function<std::string(const std::string&)> IsInteger(std::int64_t least, std::int64_t most);
std::function<std::string(const std::string&)> IsNumber(double least, double most);

/// Reports that a sweep was stopped, and `more`.
void TellStopped(std::size_t done, std::int64_t runs, const std::string& more = "");

/// Absolute, links followed as far as they can be: the same for two names of one file.
std::filesystem::path Resolved(const std::string& path);

/// Refuses an output that, with its `.partial`, is or holds what the command reads: --force would
/// remove it. Paths may be empty. Error: kCannotCreate.
void KeepInputs(const std::string& output, const std::vector<std::string>& inputs);

/// Where output goes, and where it would if nothing were there.
struct Output {
  std::filesystem::path folder, named;
};
/// Named is `given`, or the config's `output:` inside runs/, or runs/PREFIX and the name of the
/// config: of its folder where it is called config.yaml, else of the file. If nothing is given, and
/// that or its `.partial` exists without `force`, the folder is the first of NAME-2, NAME-3, ... of
/// which neither does.
/// Errors: kCannotCreate where `given` is runs/ itself, or it would replace the config or what that
/// reads; kNotTrusted, kBadConfig.
Output OutputFolder(const std::string& given, const Config& config, const Input& input, bool force,
                    const std::string& prefix = "");
/// Says so where the folder is not the one that is named. To be called once the config is known to
/// be right.
void TellOutput(const Output& output);

}  // namespace alidade::cli
