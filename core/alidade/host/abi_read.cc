// SPDX-License-Identifier: Apache-2.0
#include "alidade/host/abi_read.h"

#include <cstdio>

namespace alidade::internal {
namespace {

/// Bytes of the character that begins at `at`, or 0 where that is none of UTF-8 [Unicode 15, table
/// 3-7].
std::size_t CharacterLength(const unsigned char* at, std::size_t left) {
  const unsigned char first = at[0];
  if (first < 0x80) return 1;
  std::size_t length = 0;
  unsigned char low = 0x80, high = 0xbf;  // of the second byte
  if (first >= 0xc2 && first <= 0xdf) length = 2;
  if (first >= 0xe0 && first <= 0xef) length = 3;
  if (first >= 0xf0 && first <= 0xf4) length = 4;
  if (length == 0 || length > left) return 0;
  if (first == 0xe0) low = 0xa0;
  if (first == 0xed) high = 0x9f;
  if (first == 0xf0) low = 0x90;
  if (first == 0xf4) high = 0x8f;
  if (at[1] < low || at[1] > high) return 0;
  for (std::size_t i = 2; i < length; ++i) {
    if (at[i] < 0x80 || at[i] > 0xbf) return 0;
  }
  return length;
}

bool IsControl(const unsigned char* at) {
  constexpr unsigned char kDelete = 0x7f;
  return at[0] < ' ' || at[0] == kDelete || (at[0] == 0xc2 && at[1] < 0xa0);
}

}  // namespace

std::string TextDefect(const char* text) {
  if (text == nullptr) return {};
  const std::size_t size = strnlen(text, ALIDADE_MAX_TEXT + 1);
  if (size > ALIDADE_MAX_TEXT) {
    return "is longer than " + std::to_string(ALIDADE_MAX_TEXT) + " bytes";
  }
  const auto* const bytes = reinterpret_cast<const unsigned char*>(text);
  for (std::size_t i = 0; i < size;) {
    const std::size_t length = CharacterLength(bytes + i, size - i);
    if (length == 0) return "is not UTF-8";
    if (IsControl(bytes + i)) return "has a control character";
    i += length;
  }
  return {};
}

std::string ShownText(const char* text) {
  std::string shown;
  const std::size_t size = text == nullptr ? 0 : strnlen(text, ALIDADE_MAX_TEXT);
  const auto* const bytes = reinterpret_cast<const unsigned char*>(text);
  for (std::size_t i = 0; i < size;) {
    const std::size_t length = CharacterLength(bytes + i, size - i);
    if (length > 0 && !IsControl(bytes + i)) {
      shown.append(text + i, length);
    } else {
      shown += '?';
    }
    i += std::max<std::size_t>(length, 1);
  }
  return shown;
}

bool GoodName(const char* name) {
  if (name == nullptr) return false;
  const std::size_t length = strnlen(name, ALIDADE_MAX_NAME + 1);
  return length > 0 && length <= ALIDADE_MAX_NAME &&
         std::all_of(name, name + length, [](char c) { return c > ' ' && c <= '~'; });
}

std::string UnknownBits(std::uint32_t flags, std::uint32_t known) {
  const std::uint32_t unknown = flags & ALIDADE_MUST_UNDERSTAND & ~known;
  if (unknown == 0) return {};
  char text[16];
  std::snprintf(text, sizeof(text), "0x%x", unknown);
  return text;
}

}  // namespace alidade::internal
