// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <cstdint>
#include <string>
#include <string_view>

#include "alidade/base/error.h"
#include "alidade/io/text_cell.h"

namespace alidade::internal {

/// Numbers between blanks and line ends, one after the other. Errors: kBadData with the place.
class BundleCursor {
 public:
  BundleCursor(std::string_view text, std::string name) : text_(text), name_(std::move(name)) {}

  /// The next number; `what` says of what, as in `a focal length`.
  double Number(const char* what) {
    const std::string_view word = Word(what);
    double value = 0.0;
    const char* const wrong = cell::ParseNumber(word, value);
    if (wrong != nullptr) FailWord(word, wrong, std::string(what) + ", a finite number");
    return value;
  }
  void Numbers(const char* what, std::size_t count, double* values) {
    for (std::size_t i = 0; i < count; ++i) values[i] = Number(what);
  }
  /// A whole number in [0, limit).
  int Index(const char* what, std::int64_t limit) {
    const std::string_view word = Word(what);
    std::int64_t value = -1;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    const bool whole = error != std::errc::invalid_argument && end == word.data() + word.size();
    if (!whole || error != std::errc() || value < 0 || value >= limit) {
      FailWord(word, whole ? "is out of range" : "is not a whole number",
               std::string(what) + ", from 0 to " + std::to_string(limit - 1));
    }
    return static_cast<int>(value);
  }
  /// The next word as it is.
  std::string_view Word(const char* what) {
    SkipBlanks();
    if (at_ == text_.size()) Fail("the file ends here", what);
    start_ = at_;
    while (at_ < text_.size() && !IsBlank(text_[at_])) ++at_;
    return text_.substr(start_, at_ - start_);
  }
  /// Fails unless there is nothing but blanks.
  void ExpectEnd(const char* what) {
    SkipBlanks();
    start_ = at_;
    if (at_ < text_.size()) Fail("more numbers than the file announces", what);
  }
  /// Leaves out the rest of the line.
  void SkipLine() {
    while (at_ < text_.size() && text_[at_] != '\n') ++at_;
  }
  /// At the word that was read last.
  [[noreturn]] void Fail(const std::string& what, const std::string& expected) const {
    const int column = static_cast<int>((at_ == text_.size() ? at_ : start_) - line_start_) + 1;
    throw Error(ExitCode::kBadData, ErrorLine(Place{name_, line_, column}, {}, what, expected));
  }

 private:
  static bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }
  void SkipBlanks() {
    for (; at_ < text_.size() && IsBlank(text_[at_]); ++at_) {
      if (text_[at_] != '\n') continue;
      ++line_;
      line_start_ = at_ + 1;
    }
    start_ = at_;
  }
  [[noreturn]] void FailWord(std::string_view word, const char* wrong,
                             const std::string& expected) const {
    const int column = static_cast<int>(start_ - line_start_) + 1;
    throw Error(ExitCode::kBadData,
                ErrorLine(Place{name_, line_, column}, {},
                          '\'' + cell::Harmless(word) + "' " + wrong, expected));
  }

  std::string_view text_;
  std::string name_;
  std::size_t at_ = 0, start_ = 0, line_start_ = 0;
  int line_ = 1;
};

}  // namespace alidade::internal
