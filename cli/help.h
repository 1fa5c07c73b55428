// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <cstddef>
#include <string>

namespace alidade::cli {

/// Format of the help of a command: arguments, and options in the groups Input, Options, Output and
/// General. The paragraphs below the options are wrapped; other lines have any width.
class HelpFormat : public CLI::Formatter {
 public:
  /// `width` is the width of lines.
  explicit HelpFormat(std::size_t width);

  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override;
  std::string make_option_opts(const CLI::Option* option) const override;
  std::string make_footer(const CLI::App* app) const override;

 private:
  std::size_t width_;
};

/// Returns the group of a command in the list of all commands.
const char* GroupOfCommand(const std::string& name);

}  // namespace alidade::cli
