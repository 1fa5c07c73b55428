// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <clocale>
#include <filesystem>
#include <string>
#include <vector>

namespace alidade::internal {

/// What a plugin shares with the program and must leave as it was.
class Surroundings {
 public:
  /// As they are now.
  Surroundings();
  /// What is no longer as in `before`, or "".
  std::string ChangeSince(const Surroundings& before) const;

 private:
  int rounding_, traps_;
  bool flushes_;
  std::string locale_;
  locale_t thread_locale_;
  std::filesystem::path folder_;
  unsigned umask_;
  bool alarm_;                            ///< a timer of the process runs
  std::vector<std::string> signals_;      ///< by number: handler and flags, whether it is blocked
  std::vector<std::string> streams_;      ///< standard input, output, error: what they lead to
  std::vector<std::string> environment_;  ///< sorted
};

}  // namespace alidade::internal
