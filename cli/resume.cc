// SPDX-License-Identifier: Apache-2.0
#include "resume.h"

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <system_error>

#include "alidade/base/words.h"
#include "alidade/host/plugin_file.h"
#include "alidade/resume/leftovers.h"
#include "console.h"

namespace alidade::cli {

void AddResume(CLI::App& command, bool& resume) {
  command
      .add_flag("--resume", resume,
                "go on with what a stopped, failed or killed run left at -o, to the same bytes as "
                "one that was not interrupted")
      ->needs(command.get_option("--output"));
}

std::string InputsText(const Input& input, const Config& config,
                       const std::vector<std::string>& arguments, const std::vector<Config>& runs,
                       const internal::PluginHashes& plugins) {
  internal::CommandInputs command{arguments, {}, internal::PluginFoldersOfEnvironment()};
  for (const std::filesystem::path& path : Absolute(input.plugin_paths)) {
    if (std::ranges::find(command.plugin_paths, path) == command.plugin_paths.end())
      command.plugin_paths.push_back(path);
  }
  return internal::InputsJson(command, config, runs, plugins);
}

bool IsFinished(const std::filesystem::path& folder, const Config& config,
                const std::string& inputs, bool force, bool quiet) {
  if (!internal::IsFinishedRun(folder, config.ToYaml(), inputs, force)) return false;
  if (!quiet) PrintNote(folder.string() + " is finished: nothing to resume");
  return true;
}

void TellResumed(const std::filesystem::path& folder,
                 const std::vector<std::filesystem::path>& resumed, const std::string& how) {
  if (resumed.empty()) {
    PrintNote(folder.string() + ": nothing to resume, starting anew");
    return;
  }
  std::vector<std::string> names;
  for (const std::filesystem::path& one : resumed) names.push_back(one.string());
  PrintNote("resuming " + internal::Join(names) + ": " + how);
}

void TellKept(const std::vector<std::filesystem::path>& resumed,
              const std::filesystem::path& folder) {
  std::error_code ignored;
  for (const std::filesystem::path& one : resumed) {
    const bool kept =
        std::filesystem::exists(one, ignored) && !std::filesystem::equivalent(one, folder, ignored);
    if (kept) PrintNote(one.string() + " stays: it holds what " + folder.string() + " has not");
  }
}

}  // namespace alidade::cli
