// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "alidade/base/error.h"
#include "alidade/resume/run_inputs.h"
#include "command.h"

/// What commands that make a run folder share: its inputs, and how they go on with an unfinished
/// one.
namespace alidade::cli {

/// The option --resume, which needs -o.
void AddResume(CLI::App& command, bool& resume);

/// The text of inputs.json for a command with these arguments, as internal::CommandInputs has them;
/// `runs` are the configs of its runs, `plugins` those that they use.
std::string InputsText(const Input& input, const Config& config,
                       const std::vector<std::string>& arguments, const std::vector<Config>& runs,
                       const internal::PluginHashes& plugins);

/// Of --resume: whether `folder` is finished already, which is said unless `quiet`. Error:
/// kCannotCreate where it is a finished run of other inputs, unless `force`.
bool IsFinished(const std::filesystem::path& folder, const Config& config,
                const std::string& inputs, bool force, bool quiet);

/// Says what is resumed.
void TellResumed(const std::filesystem::path& folder,
                 const std::vector<std::filesystem::path>& resumed, const std::string& how);
/// Says which of those folders are still there, as they hold something else.
void TellKept(const std::vector<std::filesystem::path>& resumed,
              const std::filesystem::path& folder);

/// f(), with the place of what `record` keeps in the message where it throws.
template <class Record, class F>
auto WithWhatIsKept(const Record& record, const F& f) {
  try {
    return f();
  } catch (const Error& e) {
    const std::filesystem::path kept = record.failed();
    if (kept.empty()) throw;
    throw Error(e.code(), std::string(e.what()) + "; what was recorded is in " + kept.string());
  }
}

}  // namespace alidade::cli
