// SPDX-License-Identifier: Apache-2.0
#include "alidade/replay/replay.h"

#include <stdlib.h>

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <cerrno>
#include <memory>
#include <system_error>

#include "alidade/io/output_file.h"
#include "command.h"
#include "console.h"

namespace alidade::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kReplayFooter = R"(Examples:
  alidade replay runs/first
  alidade replay runs/first -o runs/again          keep the repeated run

DIR is a folder that `alidade run` or `alidade sweep` wrote. The files inputs.json and
config.resolved.yaml in this folder record the inputs. All files are compared, except files with
wall-clock times such as timing.json. Exit code 1: a file differs.)";

struct ReplayArguments {
  std::string folder, output;
  bool json = false, quiet = false;
};

/// Temporary folder, which the destructor removes.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::error_code error;
    const fs::path temporary = fs::temp_directory_path(error);
    if (error) {
      throw Error(
          ExitCode::kCannotCreate,
          "TMPDIR: the folder for temporary files does not exist; expected an existing folder");
    }
    std::string name = (temporary / "alidade-replay-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) internal::FailCreate(name, errno);
    path_ = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

/// Repeats the recorded command with the output folder `output`. Returns the exit code of the
/// command.
ExitCode RepeatCommand(const internal::RecordedInputs& recorded, const fs::path& folder,
                       const fs::path& scratch, const fs::path& output,
                       const std::function<ExitCode(const std::vector<std::string>&)>& execute) {
  // The title contains the name of the config file, so the copy must have this name. The copy has a
  // separate folder to avoid a clash of names.
  const fs::path config = scratch / "config" / fs::path(recorded.config).filename();
  std::error_code error;
  fs::create_directory(config.parent_path(), error);
  if (error) internal::FailCreate(config.parent_path().string(), error.value());
  fs::copy_file(folder / internal::kResolvedConfig, config, error);
  if (error) {
    throw Error(ExitCode::kInputMissing,
                ErrorLine(Place{(folder / internal::kResolvedConfig).string()}, {},
                          "the file cannot be copied: " + error.message()));
  }
  std::vector<std::string> arguments = recorded.command.arguments;
  arguments.insert(arguments.end(), {config.string(), "-o", output.string(), "--quiet"});
  for (const std::string& setting : recorded.command.settings) {
    arguments.insert(arguments.end(), {"--recorded-set", setting});
  }
  for (const fs::path& path : recorded.command.plugin_paths) {
    if (fs::exists(path, error))
      arguments.insert(arguments.end(), {"--plugin-path", path.string()});
  }
  std::string folders;
  for (const fs::path& path : recorded.command.plugin_folders) {
    folders += (folders.empty() ? "" : ":") + path.string();
  }
  ::setenv("ALIDADE_PLUGIN_PATH", folders.c_str(), 1);
  return execute(arguments);
}

ExitCode Replay(const ReplayArguments& arguments,
                const std::function<ExitCode(const std::vector<std::string>&)>& execute) {
  const fs::path folder = Resolved(arguments.folder);
  const internal::RecordedInputs recorded = internal::ReadReplayable(arguments.folder);
  const ScratchFolder scratch;
  const fs::path repeated =
      arguments.output.empty() ? scratch.path() / "made/again" : fs::path(arguments.output);
  const ExitCode code = RepeatCommand(recorded, folder, scratch.path(), repeated, execute);
  if (StopRequested()) return ExitCode::kStopped;
  std::error_code ignored;
  const bool is_complete = fs::exists(repeated / internal::kInputsFile, ignored);
  if (code == ExitCode::kStopped || code == ExitCode::kUsage || !is_complete) return code;
  const internal::ReplayResult result = internal::CompareReplay(folder, repeated);
  if (arguments.json) {
    Print(internal::ReplayJson(result));
  } else if (!arguments.quiet || !result.equal()) {
    PrintText(internal::ReplayText(result, arguments.folder));
  }
  return result.equal() ? ExitCode::kOk : ExitCode::kFound;
}

}  // namespace

void AddReplay(CLI::App& program, Action& action,
               const std::function<ExitCode(const std::vector<std::string>&)>& execute) {
  CLI::App& command = *program.add_subcommand(
      "replay", "Repeat a run or a sweep, compare every byte, and list the files that differ");
  const auto arguments = std::make_shared<ReplayArguments>();
  command.add_option("DIR", arguments->folder, "folder of a run or sweep")
      ->option_text(" ")
      ->required()
      ->check(IsNonEmpty);
  AddOutput(command, arguments->output,
            "write the repeated run to this folder and keep it; default: a temporary folder");
  command.add_flag("--json", arguments->json, "print the result as JSON");
  command.add_flag("--quiet", arguments->quiet, "print differences and errors only");
  command.footer(kReplayFooter);
  command.callback([&action, arguments, execute] {
    action = [arguments, execute] { return Replay(*arguments, execute); };
  });
}

}  // namespace alidade::cli
