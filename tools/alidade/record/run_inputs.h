// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "alidade/run/experiment.h"

/// What a run folder was made from: `inputs.json`. Next to `config.resolved.yaml` it has all that
/// it takes to make the same bytes again.
namespace alidade::internal {

constexpr const char* kInputsFile = "inputs.json";
constexpr const char* kResolvedConfig = "config.resolved.yaml";

/// The part that the command line gives.
struct CommandInputs {
  /// The command and those of its options that a byte depends on, but for the config and what is in
  /// its resolved text: {"run", "--covariances"}.
  std::vector<std::string> arguments;
  std::vector<std::filesystem::path> plugin_paths;  ///< of --plugin-path
  /// Of the environment. What is refused there is no error, and so they are no difference either.
  std::vector<std::filesystem::path> plugin_folders;
};

/// The files of the plugins that a run uses: of its models in the order of the config, of its
/// source and estimators.
std::vector<std::filesystem::path> PluginsInUse(const Experiment& experiment, const Config& config,
                                                const PluginHost& host);

/// SHA-256 of a plugin in use. Error: kIo.
std::string PluginHash(const std::filesystem::path& file);

/// The text of `inputs.json`. Reads plugins and data for their hashes; a folder of data stands for
/// the files in it, a pipe has no hash.
std::string InputsJson(const CommandInputs& command, const Config& config,
                       const std::vector<std::filesystem::path>& plugins);

/// What is recorded in such a text.
struct RecordedInputs {
  CommandInputs command;
  std::string config;     ///< name of the file, without its folder
  std::string read_once;  ///< what of the data was a pipe; "": nothing
};
/// Error: kBadData where `text`, the contents of `file`, is none.
RecordedInputs ReadInputs(const std::string& text, const std::string& file);

/// What differs between two texts of `inputs.json`, one of them in `file`, a line each: `plugin
/// ratio.so: now 1f0c..., was 9a3b...`. Error: kBadData.
std::vector<std::string> InputDifferences(const std::string& before, const std::string& file,
                                          const std::string& now);

}  // namespace alidade::internal
