// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/sweep/sweep.h"

/// How commands that make the folder of a sweep end.
namespace alidade::cli {

/// Writes a sweep into its folder, which is to be `path`, and says how its runs went: those that
/// failed, the tables unless `quiet`, where it lies. Gives the exit code. Errors: those of
/// SweepFolder::Write.
ExitCode FinishSweep(SweepFolder& folder, const std::filesystem::path& path,
                     const SweepResult& result, const Config& config, bool quiet);
ExitCode FinishSweep(SweepFolder& folder, const std::filesystem::path& path,
                     const VariedSweep& sweep, const Config& config, bool quiet);

}  // namespace alidade::cli
