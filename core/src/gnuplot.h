// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace alidade::internal {

/// Runs gnuplot, found through PATH, in `folder`, without a shell and without the user's settings.
/// Returns "" or why it did not work. One minute is the most it gets.
std::string RunGnuplot(const std::filesystem::path& folder,
                       const std::vector<std::string>& arguments);

/// What RunGnuplot returns where there is no gnuplot.
inline constexpr const char* kNoGnuplot = "gnuplot is not installed";

}  // namespace alidade::internal
