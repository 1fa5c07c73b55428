// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "alidade/base/utf8.h"
#include "alidade/config/tree.h"

namespace alidade::internal {
namespace {

constexpr std::size_t kMaxSize = 1 << 20;
constexpr int kMaxUnclosed = 4096;
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

class TextCheck {
 public:
  explicit TextCheck(const Origin& origin) : origin_(origin) {}

  std::string Run(std::string_view text) {
    std::string clean;
    clean.reserve(text.size());
    while (!text.empty()) {
      const std::size_t size = Utf8Length(text);
      if (size == 0) Fail("invalid UTF-8", "UTF-8 text");
      const std::string_view character = text.substr(0, size);
      text.remove_prefix(size);
      if (character == kByteOrderMark) Fail("byte order mark inside the text");
      if (character[0] == '\r') {
        if (!text.starts_with('\n')) Fail("carriage return without a line feed");
        continue;
      }
      CheckCharacter(character[0]);
      clean += character;
      column_ += static_cast<int>(size);
      if (character[0] == '\n') {
        ++line_;
        column_ = 1;
        in_indent_ = true;
      }
    }
    return clean;
  }

 private:
  void CheckCharacter(char c) {
    if (c == '\0') Fail("NUL byte", "text");
    if ((c > 0 && c < ' ' && c != '\t' && c != '\n') || c == 0x7F) {
      constexpr std::string_view kHex = "0123456789abcdef";
      Fail(std::string("control character 0x") + kHex[c >> 4] + kHex[c & 15]);
    }
    if (in_indent_ && c == '\t') Fail("tab in the indentation", "spaces");
    if (c != ' ') in_indent_ = false;
    if (c == '[' || c == '{') ++unclosed_;
    if (c == ']' || c == '}') unclosed_ = std::max(0, unclosed_ - 1);
    // The scanner of yaml-cpp would queue a token for each before the depth is known.
    if (unclosed_ > kMaxUnclosed) {
      Fail("nested too deep", "at most " + std::to_string(kMaxDepth) + " levels");
    }
  }

  [[noreturn]] void Fail(std::string_view what, std::string_view expected = {}) {
    Place place{origin_.file};
    if (origin_.has_lines) place = Place{origin_.file, line_, column_};
    FailAt(place, origin_.key_prefix, what, expected);
  }

  const Origin& origin_;
  int line_ = 1;
  int column_ = 1;
  int unclosed_ = 0;
  bool in_indent_ = true;
};

}  // namespace

bool IsUtf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t size = Utf8Length(text);
    if (size == 0) return false;
    text.remove_prefix(size);
  }
  return true;
}

std::string CleanText(std::string_view text, const Origin& origin) {
  if (text.size() > kMaxSize) {
    FailAt(Place{origin.file}, origin.key_prefix, "larger than 1 MiB", "a config of at most 1 MiB");
  }
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  return TextCheck(origin).Run(text);
}

}  // namespace alidade::internal
