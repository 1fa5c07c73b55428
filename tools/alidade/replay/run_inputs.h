// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/plugin/plugin_host.h"

/// `inputs.json`, the record of a run's inputs. Together with `config.resolved.yaml` it suffices
/// to compute the same bytes again.
namespace alidade::internal {

constexpr const char* kInputsFile = "inputs.json";
constexpr const char* kResolvedConfig = "config.resolved.yaml";

/// Inputs from the command line and the environment.
struct CommandInputs {
  /// The command and those of its options that affect the output: {"run", "--covariances"}. The
  /// config, and options that its resolved text contains, are omitted.
  std::vector<std::string> arguments;
  std::vector<std::filesystem::path> plugin_paths;  ///< of --plugin-path
  /// From the environment. A rejected plugin in them is not an error. They are therefore not
  /// compared.
  std::vector<std::filesystem::path> plugin_folders;
};

/// Returns the plugin files that runs of these configs use, each once. A plugin is used if any
/// `model` or `type` in a config, overrides included, names one of its models, sources or
/// estimators.
std::vector<std::filesystem::path> FindUsedPlugins(const std::vector<Config>& configs,
                                                   const PluginHost& host);

/// SHA-256 of each file by its name without the folder.
using PluginHashes = std::multimap<std::string, std::string>;
/// Computes the hashes of files. Error: kIo.
PluginHashes HashFiles(const std::vector<std::filesystem::path>& files);

/// Composes the text of `inputs.json`. `config` is the one that `config.resolved.yaml` contains,
/// `runs` are the configs of the runs. Reads the data files of their sources for the hashes. A
/// folder stands for the files in it; a pipe has no hash. Error: kIo.
std::string InputsJson(const CommandInputs& command, const Config& config,
                       const std::vector<Config>& runs, const PluginHashes& plugins);

/// The parts of an `inputs.json` that a replay needs.
struct RecordedInputs {
  CommandInputs command;
  std::string config;     ///< name of the file, without its folder
  std::string read_once;  ///< path of the data source that was a pipe; "": none was
};
/// Parses the text of an `inputs.json`. Error: kBadData if it is invalid; the message names `file`.
RecordedInputs ReadInputs(const std::string& text, const std::string& file);

/// Returns the text of an `inputs.json` without one option of the command and its value.
std::string WithoutOption(std::string text, const std::string& option, const std::string& value);

/// Lists the differences between two texts of `inputs.json`, one line each: `plugin ratio.so: now
/// 1f0c..., was 9a3b...`. `file` is the path of the recorded one, for messages. Error: kBadData.
std::vector<std::string> InputDifferences(const std::string& recorded, const std::string& file,
                                          const std::string& current);

/// The texts of the two files that record the inputs of a folder.
struct InputTexts {
  std::string config, inputs;
};
/// Reads the two files of `folder`. Errors: kInputMissing, kIo.
InputTexts ReadInputTexts(const std::filesystem::path& folder);
/// Describes the differences between recorded and current inputs on one line; "" if they are
/// equal. `file` is the recorded inputs.json. Error: kBadData.
std::string DescribeDifferences(const InputTexts& recorded, const std::string& file,
                                const InputTexts& current);

}  // namespace alidade::internal
