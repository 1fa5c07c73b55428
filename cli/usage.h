// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/App.hpp>
#include <string>
#include <vector>

/// Command lines that CLI11 does not accept: common words for a command, and error messages.
namespace alidade::cli {

/// Returns the command line with the words for a command replaced that other programs use: `help`
/// and `help COMMAND` by `--help`, `version` by `--version`, `list` by `plugins list`.
std::vector<std::string> WithCommonWords(std::vector<std::string> arguments);

/// Returns the error message for a command line that CLI11 rejects. `command` is the innermost
/// command on the command line.
std::string UsageErrorText(const CLI::App& command, const CLI::ParseError& error);

}  // namespace alidade::cli
