// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <cstdint>
#include <string>
#include <string_view>

#include "alidade/base/error.h"
#include "alidade/io/text_cell.h"

namespace alidade::internal {

/// Reader of numbers separated by white space. The parameter `quantity` of a function is the name
/// of the expected value in error messages, as in `a focal length`. Errors: kBadData with the
/// position in the file.
class BundleCursor {
 public:
  /// If `by_line` is true, only NextRow() and NextLine() continue at another line.
  BundleCursor(std::string_view text, std::string name, bool by_line = false)
      : text_(text), name_(std::move(name)), by_line_(by_line) {}

  /// Reads the next number.
  double Number(const char* quantity) {
    const std::string_view word = Word(quantity);
    double value = 0.0;
    const char* const problem = cell::ParseNumber(word, value);
    if (problem != nullptr) FailWord(word, problem, std::string(quantity) + ", a finite number");
    return value;
  }
  void Numbers(const char* quantity, std::size_t count, double* values) {
    for (std::size_t i = 0; i < count; ++i) values[i] = Number(quantity);
  }
  /// Reads an integer in [0, limit).
  int Index(const char* quantity, std::int64_t limit) {
    return static_cast<int>(Integer(quantity, 0, limit - 1));
  }
  /// Reads an integer in [low, high].
  std::int64_t Integer(const char* quantity, std::int64_t low, std::int64_t high) {
    const std::string_view word = Word(quantity);
    std::int64_t value = low - 1;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    const bool is_integer =
        error != std::errc::invalid_argument && end == word.data() + word.size();
    if (!is_integer || error != std::errc() || value < low || value > high) {
      FailWord(
          word, is_integer ? "is out of range" : "is not a whole number",
          std::string(quantity) + ", from " + std::to_string(low) + " to " + std::to_string(high));
    }
    return value;
  }
  /// Reads the next word.
  std::string_view Word(const char* quantity) {
    if (by_line_ && IsAtLineEnd()) {
      word_start_ = offset_;
      Fail("the line ends here", quantity);
    }
    SkipBlanks();
    if (offset_ == text_.size()) Fail("the file ends here", quantity);
    word_start_ = offset_;
    while (offset_ < text_.size() && !IsBlank(text_[offset_])) ++offset_;
    return text_.substr(word_start_, offset_ - word_start_);
  }
  /// Fails if anything but white space follows.
  void ExpectEnd(const char* quantity) {
    SkipBlanks();
    word_start_ = offset_;
    if (offset_ < text_.size()) Fail("the file contains additional numbers", quantity);
  }
  /// Skips the remainder of the line.
  void SkipLine() {
    while (offset_ < text_.size() && text_[offset_] != '\n') ++offset_;
  }
  /// Skips empty lines and comments, which begin with `#`. Returns false at the end of the file.
  bool NextRow() {
    for (;; SkipLine()) {
      SkipBlanks();
      if (offset_ == text_.size()) return false;
      if (text_[offset_] != '#') return true;
    }
  }
  /// Continues at the beginning of the next line.
  void NextLine() {
    SkipLine();
    if (offset_ == text_.size()) return;
    line_start_ = ++offset_;
    ++line_;
  }
  /// Skips blanks. Returns true at the end of the line or file.
  bool IsAtLineEnd() {
    while (offset_ < text_.size() && text_[offset_] != '\n' && IsBlank(text_[offset_])) ++offset_;
    return offset_ == text_.size() || text_[offset_] == '\n';
  }
  /// Reads the remainder of the line without the blanks around it.
  std::string_view RemainderOfLine() {
    const std::size_t start = IsAtLineEnd() ? offset_ : (word_start_ = offset_);
    SkipLine();
    std::string_view remainder = text_.substr(start, offset_ - start);
    while (!remainder.empty() && IsBlank(remainder.back())) remainder.remove_suffix(1);
    return remainder;
  }
  /// Reports an error at the word that was read last.
  [[noreturn]] void Fail(const std::string& problem, const std::string& expected) const {
    const int column =
        static_cast<int>((offset_ == text_.size() ? offset_ : word_start_) - line_start_) + 1;
    throw Error(ExitCode::kBadData, ErrorLine(Place{name_, line_, column}, {}, problem, expected));
  }

 private:
  static bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }
  void SkipBlanks() {
    for (; offset_ < text_.size() && IsBlank(text_[offset_]); ++offset_) {
      if (text_[offset_] != '\n') continue;
      ++line_;
      line_start_ = offset_ + 1;
    }
    word_start_ = offset_;
  }
  [[noreturn]] void FailWord(std::string_view word, const char* problem,
                             const std::string& expected) const {
    const int column = static_cast<int>(word_start_ - line_start_) + 1;
    throw Error(ExitCode::kBadData,
                ErrorLine(Place{name_, line_, column}, {},
                          '\'' + cell::PrintableStart(word) + "' " + problem, expected));
  }

  std::string_view text_;
  std::string name_;
  bool by_line_;
  std::size_t offset_ = 0, word_start_ = 0, line_start_ = 0;
  int line_ = 1;
};

}  // namespace alidade::internal
