// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>

namespace alidade::internal {

/// Returns the size in bytes of the UTF-8 character at the start of `text`, or 0 if the bytes are
/// invalid (Unicode 15, table 3-7).
inline std::size_t Utf8Length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned lead = byte(0);
  if (lead < 0x80) return 1;
  const std::size_t size = lead < 0xC2   ? 0
                           : lead < 0xE0 ? 2
                           : lead < 0xF0 ? 3
                           : lead < 0xF5 ? 4
                                         : 0;
  if (size == 0 || text.size() < size) return 0;
  const unsigned low = lead == 0xE0 ? 0xA0 : lead == 0xF0 ? 0x90 : 0x80;
  const unsigned high = lead == 0xED ? 0x9F : lead == 0xF4 ? 0x8F : 0xBF;
  if (byte(1) < low || byte(1) > high) return 0;
  for (std::size_t i = 2; i < size; ++i) {
    if (byte(i) < 0x80 || byte(i) > 0xBF) return 0;
  }
  return size;
}

/// Returns true if all of `text` is valid UTF-8.
inline bool IsUtf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t size = Utf8Length(text);
    if (size == 0) return false;
    text.remove_prefix(size);
  }
  return true;
}

/// Returns true if the UTF-8 character at the start of `text` is a control character, including
/// U+0080 to U+009F.
inline bool IsControl(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  return byte(0) < ' ' || byte(0) == 0x7F || (byte(0) == 0xC2 && byte(1) < 0xA0);
}

/// Returns the number of characters of a text in UTF-8, which is its width on a terminal.
inline std::size_t TextWidth(std::string_view text) {
  return static_cast<std::size_t>(
      std::ranges::count_if(text, [](char c) { return (c & 0xC0) != 0x80; }));
}

/// Returns `text` in printable form. Replaces each invalid byte by `?`, and each control character
/// unless `allowed_controls` contains it.
inline std::string PrintableUtf8(std::string_view text, std::string_view allowed_controls) {
  std::string printable;
  while (!text.empty()) {
    const std::size_t size = Utf8Length(text);
    const bool is_printable =
        size > 0 && (!IsControl(text) || allowed_controls.find(text[0]) != allowed_controls.npos);
    printable += is_printable ? text.substr(0, size) : "?";
    text.remove_prefix(std::max<std::size_t>(size, 1));
  }
  return printable;
}

}  // namespace alidade::internal
