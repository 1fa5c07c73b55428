// SPDX-License-Identifier: Apache-2.0
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cstdlib>
#include <exception>
#include <new>

#include "alidade/base/text.h"
#include "command.h"
#include "console.h"
#include "help.h"
#include "usage.h"

namespace alidade::cli {
namespace {

constexpr const char* kProgramFooter = R"(Examples:
  alidade doctor                                   check the installation
  alidade plugins list                             list models, sources and estimators
  alidade check stereo_disparity --config examples/05_depth_principled/config.yaml
  alidade explain examples/05_depth_principled/config.yaml
  alidade run examples/05_depth_principled/config.yaml -o runs/first
  alidade replay runs/first                        repeat the run and compare every byte
  alidade sweep examples/05_depth_principled/config.yaml --runs 200
  alidade eval runs/slam                           compare trajectories with truth: ATE, RPE
  alidade compare examples/08_depth_all_estimators/config.yaml

`alidade COMMAND --help` describes a command. Exit codes: 0 ok, 1 problem found, 2 usage,
65 bad data, 66 input missing, 69 plugin missing or refused, 70 internal, 73 cannot create output,
74 input/output, 75 stopped by a signal, 77 not trusted, 78 bad config, 79 diverged.)";

using ArgumentList = std::vector<std::string>;

std::string CommandLine(const ArgumentList& arguments) {
  std::string line = "alidade";
  for (const std::string& argument : arguments) line += ' ' + internal::ShellWord(argument);
  return line;
}

/// Returns the arguments in reverse order, as CLI11 expects them. Replaces underscores in the names
/// of options by hyphens: `--t_max_diff` of evo is `--t-max-diff`. Does not change arguments after
/// `--`.
ArgumentList ReversedArguments(ArgumentList arguments) {
  for (std::string& argument : arguments) {
    if (argument == "--") break;
    if (!argument.starts_with("--")) continue;
    const std::size_t name = std::min(argument.find('='), argument.size());
    std::replace(argument.begin(), argument.begin() + static_cast<std::ptrdiff_t>(name), '_', '-');
  }
  std::ranges::reverse(arguments);
  return arguments;
}

constexpr const char* kLogLevels = "trace, debug, info, warning, error, off";

std::string IsLogLevel(const std::string& text) {
  return LogLevelOf(text) ? "" : "'" + text + "' is not a log level; expected one of " + kLogLevels;
}

/// Returns the log level of the terminal. --log-level, whose argument is `log_level`, has
/// precedence over --quiet, which means `error`. --quiet has precedence over the variable
/// ALIDADE_LOG. The default is `warning`.
LogLevel LogLevelFor(const CLI::App& command, const std::string& log_level) {
  if (!log_level.empty()) return *LogLevelOf(log_level);
  const CLI::Option* quiet = command.get_option_no_throw("--quiet");
  if (quiet != nullptr && quiet->count() > 0) return LogLevel::kError;
  const char* const variable = std::getenv("ALIDADE_LOG");
  if (variable == nullptr || *variable == '\0') return LogLevel::kWarning;
  if (const auto level = LogLevelOf(variable)) return *level;
  throw Error(ExitCode::kUsage, "ALIDADE_LOG: " + IsLogLevel(variable));
}

ExitCode Execute(const ArgumentList& arguments);

void Describe(CLI::App& program, Action& action, const std::string& command_line,
              std::string& log_level) {
  program.formatter(std::make_shared<HelpFormat>(OutputWidth()));
  program.footer(kProgramFooter);
  program.set_version_flag("--version", "alidade " ALIDADE_VERSION, "print the version and exit");
  program.require_subcommand(1);
  AddRun(program, action, command_line);
  AddCompare(program, action, command_line);
  AddSweep(program, action, command_line);
  AddMerge(program, action);
  AddReplay(program, action, Execute);
  AddSimulate(program, action);
  AddBundle(program, action);
  AddEval(program, action);
  AddDiagnose(program, action);
  AddReport(program, action);
  AddExplain(program, action);
  AddPlugins(program, action);
  AddCheck(program, action);
  AddDoctor(program, action);
  const auto polish = [&log_level](const auto& self, CLI::App& app) -> void {
    app.get_help_ptr()->description("print this help and exit");
    app.add_option("--log-level", log_level,
                   std::string("minimum level of messages on standard error: ") + kLogLevels)
        ->option_text("LEVEL")
        ->check(IsLogLevel);
    for (CLI::App* command : app.get_subcommands({})) {
      command->group(GroupOfCommand(command->get_name()));
      self(self, *command);
    }
  };
  polish(polish, program);
}

/// Returns the innermost command on the command line.
const CLI::App& InnermostCommand(const CLI::App& app) {
  const auto chosen = app.get_subcommands();
  return chosen.empty() ? app : InnermostCommand(*chosen.front());
}

/// Returns the name of a command, preceded by the names of its parents, such as `alidade plugins
/// info`.
std::string FullName(const CLI::App& command) {
  const CLI::App* parent = command.get_parent();
  return parent == nullptr ? command.get_name() : FullName(*parent) + ' ' + command.get_name();
}

ExitCode UsageError(const CLI::App& command, const std::string& message) {
  PrintErrors(message);
  PrintNote("see `" + FullName(command) + " --help`");
  return ExitCode::kUsage;
}

ExitCode Fail(const CLI::App& program, const CLI::ParseError& error) {
  const CLI::App& command = InnermostCommand(program);
  const bool has_unknown_command =
      program.get_subcommands().empty() && program.remaining_size() > 0;
  if (dynamic_cast<const CLI::CallForHelp*>(&error) != nullptr && !has_unknown_command) {
    PrintText(program.help());
    return ExitCode::kOk;
  }
  if (dynamic_cast<const CLI::CallForVersion*>(&error) != nullptr) {
    Print(std::string(error.what()) + '\n');
    return ExitCode::kOk;
  }
  return UsageError(command, UsageErrorText(command, error));
}

ExitCode Execute(const ArgumentList& arguments) {
  CLI::App program(
      "Compare Kalman filters, smoothers and batch estimators on one model. Write h(x) once.",
      "alidade");
  Action action;
  std::string log_level;
  Describe(program, action, CommandLine(arguments), log_level);
  try {
    program.parse(ReversedArguments(WithCommonWords(arguments)));
  } catch (const CLI::ParseError& error) {
    return Fail(program, error);
  }
  try {
    ShowLog(LogLevelFor(InnermostCommand(program), log_level));
    return action();
  } catch (const Error& error) {
    if (error.code() != ExitCode::kUsage) throw;
    return UsageError(InnermostCommand(program), error.what());
  }
}

ExitCode RunGuarded(int argc, char** argv) {
  try {
    return Execute(ArgumentList(argv + 1, argv + std::max(argc, 1)));
  } catch (...) {
    const Failure failure = CaughtFailure();
    PrintErrors(failure.reason);
    return failure.code;
  }
}

}  // namespace
}  // namespace alidade::cli

int main(int argc, char** argv) {
  // Ceres logs with glog, which reads this variable when the Ceres plugins load glog. The value 3
  // means that only fatal errors are printed; the results contain the solver's reports. setenv does
  // not replace a value that the user has set.
  setenv("GLOG_minloglevel", "3", 0);
  alidade::cli::PrepareConsole();
  const alidade::ExitCode code = alidade::cli::RunGuarded(argc, argv);
  // A reader that has closed the pipe has read all that it needs.
  const bool is_enough = alidade::cli::OutputClosed() && code == alidade::ExitCode::kStopped;
  return static_cast<int>(is_enough ? alidade::ExitCode::kOk : code);
}
