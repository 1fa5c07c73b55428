// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cfenv>
#include <clocale>
#include <filesystem>
#include <limits>
#include <string>
#include <system_error>

namespace alidade::internal {

/// What a plugin shares with the program and must leave as it was.
struct Surroundings {
  int rounding = std::fegetround();
  int traps = fegetexcept();
  bool flushes = [] {
    volatile double tiny = std::numeric_limits<double>::min();
    return tiny / 2.0 == 0.0;
  }();
  std::string locale = std::setlocale(LC_ALL, nullptr);
  locale_t thread_locale = uselocale(nullptr);
  std::filesystem::path folder = [] {
    std::error_code ignored;  // it may have been removed
    return std::filesystem::current_path(ignored);
  }();

  /// What is no longer as in `before`, or "".
  std::string ChangeSince(const Surroundings& before) const {
    if (rounding != before.rounding) return "changed the rounding mode";
    if (traps != before.traps) return "changed the floating-point traps";
    if (flushes != before.flushes) return "makes the processor flush small numbers to zero";
    if (locale != before.locale || thread_locale != before.thread_locale) {
      return "changed the locale from '" + before.locale + "' to '" + locale + "'";
    }
    if (folder != before.folder) return "changed the current folder to " + folder.string();
    return {};
  }
};

}  // namespace alidade::internal
