// SPDX-License-Identifier: Apache-2.0
#include "help.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>
#include <vector>

#include "alidade/io/wrap_text.h"

namespace alidade::cli {
namespace {

constexpr std::array kGroups = {"Input", "Options", "Output", "General"};

/// Returns the group of an option. Options without an entry are in the group Options.
std::string_view GroupOfOption(const CLI::Option& option) {
  constexpr std::pair<std::string_view, const char*> kMembers[] = {
      {"set", "Input"},          {"plugin-path", "Input"}, {"allow-outside", "Input"},
      {"config", "Input"},       {"format", "Input"},      {"camera", "Input"},
      {"start", "Input"},        {"skip-nan", "Input"},    {"output", "Output"},
      {"force", "Output"},       {"resume", "Output"},     {"all", "Output"},
      {"verbose", "Output"},     {"quiet", "Output"},      {"json", "Output"},
      {"markdown", "Output"},    {"latex", "Output"},      {"follow", "Output"},
      {"covariances", "Output"}, {"save-video", "Output"}, {"view", "Output"},
      {"video", "Output"},       {"images", "Output"},     {"live", "Output"},
      {"html", "Output"},        {"help", "General"},      {"version", "General"},
      {"log-level", "General"}};
  for (const auto& [name, group] : kMembers) {
    if (std::ranges::count(option.get_lnames(), name) > 0) return group;
  }
  return "Options";
}

/// Joins the lines of each paragraph, so that the paragraph can be wrapped again. Indented lines,
/// empty lines and headings remain lines.
std::string JoinedParagraphs(std::string_view text) {
  std::string joined;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool joins = text[i] == '\n' && i > 0 && i + 1 < text.size() && text[i - 1] != '\n' &&
                       text[i - 1] != ':' && text[i + 1] != '\n' && text[i + 1] != ' ';
    const std::size_t begin = joined.rfind('\n') + 1;  // of the current line
    joined += joins && !joined.substr(begin).starts_with(' ') ? ' ' : text[i];
  }
  return joined;
}

}  // namespace

HelpFormat::HelpFormat(std::size_t width) : width_(width) {
  label("SUBCOMMAND", "COMMAND");
  label("Positionals", "Arguments");
  column_width(28);
}

std::string HelpFormat::make_help(const CLI::App* app, std::string name,
                                  CLI::AppFormatMode mode) const {
  std::string text =
      make_description(app) + make_usage(app, std::move(name)) + make_positionals(app);
  for (const char* const group : kGroups) {
    const std::vector<const CLI::Option*> options =
        app->get_options([group](const CLI::Option* option) {
          return option->nonpositional() && !option->get_group().empty() &&
                 GroupOfOption(*option) == group;
        });
    if (!options.empty()) text += make_group(group, false, options);
  }
  return text + make_subcommands(app, mode) + '\n' + make_footer(app);
}

std::string HelpFormat::make_option_opts(const CLI::Option* option) const {
  const std::string& text = option->get_option_text();
  return text.empty() || text == " " ? "" : ' ' + text;
}

std::string HelpFormat::make_footer(const CLI::App* app) const {
  return internal::WrapText(JoinedParagraphs(app->get_footer()), width_, 0) + '\n';
}

const char* GroupOfCommand(const std::string& name) {
  constexpr std::pair<std::string_view, const char*> kMembers[] = {
      {"run", "Run"},         {"compare", "Run"},     {"sweep", "Run"},
      {"merge", "Run"},       {"replay", "Run"},      {"simulate", "Run"},
      {"bundle", "Run"},      {"eval", "Evaluate"},   {"diagnose", "Evaluate"},
      {"report", "Evaluate"}, {"explain", "Inspect"}, {"plugins", "Inspect"},
      {"check", "Inspect"},   {"doctor", "Inspect"}};
  for (const auto& [member, group] : kMembers) {
    if (name == member) return group;
  }
  return "Commands";
}

}  // namespace alidade::cli
