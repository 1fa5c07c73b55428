// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <clocale>
#include <cstdlib>
#include <fstream>
#include <locale>
#include <string>

#include "support/temporary_folder.h"

namespace alidade::testing {

/// Locale in which C and C++ write `1,5` for 1.5. The locale is active during the lifetime of the
/// object. The object builds the locale with localedef, so no such locale has to be installed.
class CommaLocale {
 public:
  CommaLocale() : before_(std::setlocale(LC_ALL, nullptr)) {
    std::ofstream(folder_ / "comma.src") << "comment_char %\nescape_char /\nLC_NUMERIC\n"
                                            "decimal_point \",\"\nthousands_sep \".\"\n"
                                            "grouping 3;3\nEND LC_NUMERIC\n";
    const std::string make = "cd '" + folder_.path().string() +
                             "' && localedef --quiet --force --no-archive -i comma.src ./comma";
    static_cast<void>(std::system((make + " >made 2>&1").c_str()));
    ::setenv("LOCPATH", folder_.path().c_str(), 1);
    active_ = std::setlocale(LC_NUMERIC, "comma") != nullptr;
    ::unsetenv("LOCPATH");
    if (active_) std::locale::global(std::locale(std::locale::classic(), new Comma));
  }
  ~CommaLocale() {
    std::locale::global(std::locale::classic());
    std::setlocale(LC_ALL, before_.c_str());
  }
  CommaLocale(const CommaLocale&) = delete;
  CommaLocale& operator=(const CommaLocale&) = delete;

  /// Returns true if the locale could be built.
  bool active() const { return active_; }

 private:
  struct Comma : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
  };

  std::string before_;
  TemporaryFolder folder_;
  bool active_ = false;
};

}  // namespace alidade::testing
