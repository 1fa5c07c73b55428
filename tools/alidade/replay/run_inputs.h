// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/plugin/plugin_host.h"

/// Record of the inputs of a run: `inputs.json`. Together with `config.resolved.yaml`, it suffices
/// to compute the same bytes again.
namespace alidade::internal {

constexpr const char* kInputsFile = "inputs.json";
constexpr const char* kResolvedConfig = "config.resolved.yaml";

/// Inputs from the command line and the environment.
struct CommandInputs {
  /// The command and the options that affect the output, as in {"run", "--covariances"}. Excludes
  /// the config, and options whose values are part of the resolved config.
  std::vector<std::string> arguments = {};
  std::vector<std::string> settings = {};  ///< values of --set, for the command that the page shows
  std::vector<std::filesystem::path> plugin_paths = {};  ///< paths from --plugin-path
  /// Folders of plugins from the environment. Unlike in `plugin_paths`, a rejected plugin in these
  /// folders is not an error. The folders are not compared.
  std::vector<std::filesystem::path> plugin_folders = {};
};

/// Returns each plugin file that runs of these configs use. A plugin is used if any `model` or
/// `type` in a config, including the overrides, is the name of a model, source or estimator of that
/// plugin.
std::vector<std::filesystem::path> FindUsedPlugins(const std::vector<Config>& configs,
                                                   const PluginHost& host);

/// SHA-256 of each file. The key is the name of the file without the folder.
using PluginHashes = std::multimap<std::string, std::string>;
/// Computes the hashes of files. Error: kIo.
PluginHashes HashFiles(const std::vector<std::filesystem::path>& files);

/// Composes the text of `inputs.json`. `config` is the config in `config.resolved.yaml`. `runs` are
/// the configs of the runs. Reads the data files of the sources to compute their hashes. If a
/// source reads a folder, each file in it has an entry. A pipe has no hash. Error: kIo.
std::string InputsJson(const CommandInputs& command, const Config& config,
                       const std::vector<Config>& runs, const PluginHashes& plugins);

/// Parts of an `inputs.json` that a replay needs.
struct RecordedInputs {
  CommandInputs command;
  std::string config;     ///< name of the config file, without the folder
  std::string read_once;  ///< path of the pipe from which the data came; "": no pipe
};
/// Parses the text of an `inputs.json`. Error: kBadData if the text is invalid. The message
/// contains `file`.
RecordedInputs ReadInputs(const std::string& text, const std::string& file);

/// Returns the text of an `inputs.json` from which one option of the command and the value of that
/// option are removed.
std::string WithoutOption(std::string text, const std::string& option, const std::string& value);

/// Lists the differences between two texts of `inputs.json`. A difference is a line such as
/// `plugin ratio.so: now 1f0c..., was 9a3b...`. `file` is the path of the recorded inputs.json, for
/// messages. Error: kBadData.
std::vector<std::string> InputDifferences(const std::string& recorded, const std::string& file,
                                          const std::string& current);

/// Returns the differences of InputDifferences() that concern the data files.
std::vector<std::string> DataDifferences(const std::string& recorded, const std::string& file,
                                         const std::string& current);

/// Texts of the two files that record the inputs of a folder.
struct InputTexts {
  std::string config, inputs;
};
/// Reads the two files of `folder`. Errors: kInputMissing, kIo.
InputTexts ReadInputTexts(const std::filesystem::path& folder);
/// Describes the differences between recorded and current inputs on one line. Returns "" if the
/// inputs are equal. `file` is the path of the recorded inputs.json. Error: kBadData.
std::string DescribeDifferences(const InputTexts& recorded, const std::string& file,
                                const InputTexts& current);

}  // namespace alidade::internal
