// SPDX-License-Identifier: Apache-2.0
#include "usage.h"

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>

#include "alidade/base/error.h"

namespace alidade::cli {
namespace {

/// Returns `; did you mean '...'?` with the command or option closest to an unknown word, or "".
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

/// Returns `problem` of an option or argument, with its meaning. `name` is its name in messages of
/// CLI11.
std::string OptionText(const CLI::App& app, const std::string& name, const std::string& problem) {
  for (const CLI::Option* const option : app.get_options()) {
    if (option->get_name() != name) continue;
    const char* const kind = option->get_positional() ? "the argument " : "the option ";
    return kind + name + problem + " (" + option->get_description() + ')';
  }
  return name + problem;
}

}  // namespace

std::vector<std::string> WithCommonWords(std::vector<std::string> arguments) {
  if (arguments.empty()) return arguments;
  const std::string first = arguments.front();
  if (first == "help") {
    arguments.erase(arguments.begin());
    arguments.emplace_back("--help");
  } else if (first == "version") {
    arguments.front() = "--version";
  } else if (first == "list") {
    arguments.insert(arguments.begin(), "plugins");
  }
  return arguments;
}

std::string UsageErrorText(const CLI::App& command, const CLI::ParseError& error) {
  const std::vector<std::string> extra = command.remaining();
  const bool needs_command = !command.get_subcommands({}).empty();
  const std::string text = error.what();
  if (extra.empty() && dynamic_cast<const CLI::RequiredError*>(&error) != nullptr) {
    if (needs_command) return "a command is missing";
    return OptionText(command, text.substr(0, text.find(" is required")), " is missing");
  }
  if (extra.empty() && dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr) {
    const std::string name = text.substr(0, text.find(':'));
    const CLI::Option* const option = command.get_option_no_throw(name);
    const bool is_repeated =
        option != nullptr && option->get_expected_max() == 1 && option->count() > 1;
    return OptionText(command, name, is_repeated ? " is given more than once" : " needs a value");
  }
  if (extra.empty()) return text;
  const std::string& word = extra.front();
  const char* const problem = word.starts_with('-') ? "unknown option '"
                              : needs_command       ? "unknown command '"
                                                    : "unexpected argument '";
  return problem + word + "'" + Suggestion(command, word);
}

}  // namespace alidade::cli
