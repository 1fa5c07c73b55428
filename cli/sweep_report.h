// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/sweep/sweep.h"

/// Last steps of `alidade sweep` and `alidade merge`, which write the folder of a sweep.
namespace alidade::cli {

/// Writes a sweep into its folder. The final path of the folder is `path`. Prints the reasons why
/// runs failed. Unless `quiet` is true, also prints the tables, the command that repeats the run of
/// the worst seed, and the path of the folder. `inputs` is the text of inputs.json. If the sweep
/// was stopped, prints `command_line` with --resume. Returns the exit code. Errors: those of
/// SweepFolder::Write.
ExitCode FinishSweep(SweepFolder& folder, const std::filesystem::path& path,
                     const SweepResult& result, const Config& config, const std::string& inputs,
                     const std::string& command_line, bool quiet);
ExitCode FinishSweep(SweepFolder& folder, const std::filesystem::path& path,
                     const VariedSweep& sweep, const Config& config,
                     const std::string& command_line, bool quiet);

}  // namespace alidade::cli
