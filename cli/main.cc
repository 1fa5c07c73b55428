// SPDX-License-Identifier: Apache-2.0
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cstdlib>
#include <exception>
#include <new>

#include "command.h"
#include "console.h"

namespace alidade::cli {
namespace {

constexpr const char* kProgramFooter = R"(Examples:
  alidade doctor                                   is everything in place?
  alidade plugins list                             sensors, motion models, sources, estimators
  alidade check stereo_disparity --config examples/05_depth_principled/config.yaml
  alidade explain examples/05_depth_principled/config.yaml
  alidade run examples/05_depth_principled/config.yaml -o runs/first
  alidade replay runs/first                        does it give the same bytes again?
  alidade sweep examples/05_depth_principled/config.yaml --runs 200
  alidade eval runs/slam                           trajectories against truth: ATE, RPE, NEES
  alidade compare examples/08_depth_all_estimators/config.yaml

`alidade COMMAND --help` describes each. Exit codes: 0 ok, 1 something found wrong, 2 usage,
65 bad data, 66 input missing, 69 plugin missing or refused, 70 internal, 73 cannot create output,
74 input/output, 75 stopped by a signal, 77 not trusted, 78 bad config, 79 diverged.)";

class Format : public CLI::Formatter {
 public:
  Format() {
    label("SUBCOMMAND", "COMMAND");
    label("Positionals", "Arguments");
    column_width(28);
  }
};

/// `text` as one word of a shell.
std::string ShellQuoted(const std::string& text) {
  constexpr const char* kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
      "%+,-./:=@_";
  if (!text.empty() && text.find_first_not_of(kPlain) == text.npos) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + '\'';
}

using Words = std::vector<std::string>;

std::string CommandLine(const Words& arguments) {
  std::string line = "alidade";
  for (const std::string& argument : arguments) line += ' ' + ShellQuoted(argument);
  return line;
}

/// The arguments, the last one first, as CLI11 takes them. An underscore in the name of an option
/// means a hyphen: `--t_max_diff` of evo is `--t-max-diff`. What follows `--` is left as it is.
Words Reversed(Words arguments) {
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
  return LogLevelOf(text) ? "" : "'" + text + "' is not a level; expected " + kLogLevels;
}

/// What the terminal shows of the log: `given` by --log-level, else errors under --quiet, else
/// ALIDADE_LOG, else warnings.
LogLevel LogLevelFor(const CLI::App& command, const std::string& given) {
  if (!given.empty()) return *LogLevelOf(given);
  const CLI::Option* quiet = command.get_option_no_throw("--quiet");
  if (quiet != nullptr && quiet->count() > 0) return LogLevel::kError;
  const char* const variable = std::getenv("ALIDADE_LOG");
  if (variable == nullptr || *variable == '\0') return LogLevel::kWarning;
  if (const auto level = LogLevelOf(variable)) return *level;
  throw Error(ExitCode::kUsage, "ALIDADE_LOG: " + IsLogLevel(variable));
}

ExitCode Execute(const Words& arguments);

void Describe(CLI::App& program, Action& action, const std::string& command_line,
              std::string& log_level) {
  program.formatter(std::make_shared<Format>());
  program.footer(kProgramFooter);
  program.set_version_flag("--version", "alidade " ALIDADE_VERSION, "print the version and leave");
  program.require_subcommand(1);
  AddRun(program, action, command_line);
  AddCompare(program, action, command_line);
  AddSweep(program, action);
  AddMerge(program, action);
  AddReplay(program, action, Execute);
  AddSimulate(program, action);
  AddBundle(program, action);
  AddExplain(program, action);
  AddPlugins(program, action);
  AddCheck(program, action);
  AddEval(program, action);
  AddDoctor(program, action);
  const auto polish = [&log_level](const auto& self, CLI::App& app) -> void {
    app.get_help_ptr()->description("print this help and leave");
    if (app.get_subcommands({}).empty()) {
      app.add_option("--log-level", log_level,
                     std::string("least level of messages on standard error: ") + kLogLevels)
          ->option_text("LEVEL")
          ->check(IsLogLevel);
    }
    for (CLI::App* command : app.get_subcommands({})) {
      command->group("Commands");
      self(self, *command);
    }
  };
  polish(polish, program);
}

/// The innermost command that the line names.
const CLI::App& Named(const CLI::App& app) {
  const auto chosen = app.get_subcommands();
  return chosen.empty() ? app : Named(*chosen.front());
}

/// The command or option nearest to a word that is none, as ` did you mean '...'?`.
std::string Suggestion(const CLI::App& app, const std::string& word) {
  std::vector<std::string> names;
  if (word.starts_with('-')) {
    for (const CLI::Option* option : app.get_options()) {
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    }
  } else {
    for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
  }
  const std::string nearest = Nearest(word.substr(0, word.find('=')), names);
  return nearest.empty() ? "" : "; did you mean '" + nearest + "'?";
}

/// What is wrong with a command line that CLI11 refuses.
std::string Complaint(const CLI::App& command, const CLI::ParseError& error) {
  const std::vector<std::string> extra = command.remaining();
  const bool wants_command = !command.get_subcommands({}).empty();
  if (extra.empty()) return wants_command ? "no command" : error.what();
  const std::string& word = extra.front();
  const char* const what = word.starts_with('-') ? "no option '"
                           : wants_command       ? "no command '"
                                                 : "unexpected argument '";
  return what + word + "'" + Suggestion(command, word);
}

/// `alidade plugins info`
std::string FullName(const CLI::App& command) {
  const CLI::App* parent = command.get_parent();
  return parent == nullptr ? command.get_name() : FullName(*parent) + ' ' + command.get_name();
}

ExitCode UsageError(const CLI::App& command, const std::string& complaint) {
  PrintErrors(complaint);
  PrintNote("see `" + FullName(command) + " --help`");
  return ExitCode::kUsage;
}

ExitCode Fail(const CLI::App& program, const CLI::ParseError& error) {
  const CLI::App& command = Named(program);
  if (dynamic_cast<const CLI::CallForHelp*>(&error) != nullptr) {
    Print(program.help());
    return ExitCode::kOk;
  }
  if (dynamic_cast<const CLI::CallForVersion*>(&error) != nullptr) {
    Print(std::string(error.what()) + '\n');
    return ExitCode::kOk;
  }
  return UsageError(command, Complaint(command, error));
}

ExitCode Execute(const Words& arguments) {
  CLI::App program("Recursive state estimation from plugins: write h(x) once.", "alidade");
  Action action;
  std::string log_level;
  Describe(program, action, CommandLine(arguments), log_level);
  try {
    program.parse(Reversed(arguments));
  } catch (const CLI::ParseError& error) {
    return Fail(program, error);
  }
  try {
    ShowLog(LogLevelFor(Named(program), log_level));
    return action();
  } catch (const Error& error) {
    if (error.code() != ExitCode::kUsage) throw;
    return UsageError(Named(program), error.what());
  }
}

ExitCode Guarded(int argc, char** argv) {
  try {
    return Execute(Words(argv + 1, argv + std::max(argc, 1)));
  } catch (...) {
    const Failure failure = CaughtFailure();
    PrintErrors(failure.reason);
    return failure.code;
  }
}

}  // namespace
}  // namespace alidade::cli

int main(int argc, char** argv) {
  // Ceres logs by glog, which is loaded with the plugins of Ceres and then reads this: nothing
  // below a fatal error. What the solver reports is in its results. A value set by the user stays.
  setenv("GLOG_minloglevel", "3", 0);
  alidade::cli::PrepareConsole();
  return static_cast<int>(alidade::cli::Guarded(argc, argv));
}
