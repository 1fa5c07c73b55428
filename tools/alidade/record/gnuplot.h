// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace alidade::internal {

/// What ends a drawing before it is done.
struct DrawingLimits {
  std::function<bool()> stop;  ///< asked every few milliseconds; may be empty
  std::chrono::steady_clock::time_point end = std::chrono::steady_clock::time_point::max();
};

/// How gnuplot fared.
struct GnuplotResult {
  enum class End { kDrawn, kFailed, kMissing, kStopped, kTimeUp } end = End::kDrawn;
  std::string complaint;  ///< of kFailed
};

/// Runs gnuplot, found through PATH, in `folder`, which has a folder `figures`, without a shell and
/// without the user's settings. It is killed if a limit is reached.
GnuplotResult RunGnuplot(const std::filesystem::path& folder,
                         const std::vector<std::string>& arguments, const DrawingLimits& limits);

/// Why no more is drawn after such an end, or "".
std::string Obstacle(GnuplotResult::End end);

}  // namespace alidade::internal
