// SPDX-License-Identifier: Apache-2.0
#include "alidade/plugin/abi_read.h"

#include <cstdio>

#include "alidade/io/utf8.h"

namespace alidade::internal {

std::string TextDefect(const char* text) {
  if (text == nullptr) return {};
  const std::size_t size = strnlen(text, ALIDADE_MAX_TEXT + 1);
  if (size > ALIDADE_MAX_TEXT) {
    return "is longer than " + std::to_string(ALIDADE_MAX_TEXT) + " bytes";
  }
  for (std::string_view remaining(text, size); !remaining.empty();) {
    const std::size_t length = Utf8Length(remaining);
    if (length == 0) return "is not UTF-8";
    if (IsControl(remaining)) return "has a control character";
    remaining.remove_prefix(length);
  }
  return {};
}

std::string PrintableText(const char* text) {
  if (text == nullptr) return {};
  return PrintableUtf8({text, strnlen(text, ALIDADE_MAX_TEXT)}, "");
}

bool IsValidName(const char* name) {
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
