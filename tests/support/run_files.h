// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include "alidade/replay/replay.h"
#include "support/program.h"

/// Functions that compare run folders.
namespace alidade::testing {

/// Returns the content of each file without wall-clock times, keyed by file name.
inline std::map<std::string, std::string> RunFiles(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = entry.path().lexically_relative(folder).string();
    if (!entry.is_regular_file() || internal::HasWallClock(name)) continue;
    files[name] = ReadText(entry.path());
  }
  return files;
}

/// Expects both folders to contain the same files with the same content. A failure names the file
/// that differs.
inline void ExpectSameFiles(const fs::path& folder, const fs::path& expected) {
  const auto files = RunFiles(folder), others = RunFiles(expected);
  EXPECT_GT(others.size(), 4u);
  for (const auto& [name, bytes] : others) {
    const auto found = files.find(name);
    EXPECT_TRUE(found != files.end() && found->second == bytes) << name;
  }
  for (const auto& [name, bytes] : files) EXPECT_TRUE(others.contains(name)) << name;
}

}  // namespace alidade::testing
