// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/plugin/plugin_host.h"

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

/// The files of the plugins that runs of these configs use, each once: of those that `host` offers,
/// every model, source and estimator that a `model` or `type` of a config names, overrides too.
std::vector<std::filesystem::path> PluginsNamed(const std::vector<Config>& configs,
                                                const PluginHost& host);

/// File name -> SHA-256, for each file, wherever it lies.
using PluginHashes = std::multimap<std::string, std::string>;
/// Error: kIo.
PluginHashes HashesOf(const std::vector<std::filesystem::path>& files);

/// The text of `inputs.json`. `config` is that of `config.resolved.yaml`, `runs` the configs of the
/// runs. Reads what the sources of these name for its hashes; a folder stands for the files in it,
/// a pipe has no hash. Error: kIo.
std::string InputsJson(const CommandInputs& command, const Config& config,
                       const std::vector<Config>& runs, const PluginHashes& plugins);

/// What is recorded in such a text.
struct RecordedInputs {
  CommandInputs command;
  std::string config;     ///< name of the file, without its folder
  std::string read_once;  ///< what of the data was a pipe; "": nothing
};
/// Error: kBadData where `text`, the contents of `file`, is none.
RecordedInputs ReadInputs(const std::string& text, const std::string& file);

/// The text of inputs.json without an option of the command and its value, as if the command had
/// not had them.
std::string WithoutOption(std::string text, const std::string& option, const std::string& value);

/// What differs between two texts of `inputs.json`, one of them in `file`, a line each: `plugin
/// ratio.so: now 1f0c..., was 9a3b...`. Error: kBadData.
std::vector<std::string> InputDifferences(const std::string& before, const std::string& file,
                                          const std::string& now);

/// The texts of the two files that say what a folder was made from.
struct MadeFrom {
  std::string config, inputs;
};
/// Those of `folder`. Errors: kInputMissing, kIo.
MadeFrom ReadMadeFrom(const std::filesystem::path& folder);
/// What differs between the two, on one line; "" if nothing does. `file` is the inputs.json of
/// `before`. Error: kBadData.
std::string DifferenceOf(const MadeFrom& before, const std::string& file, const MadeFrom& now);

}  // namespace alidade::internal
