// SPDX-License-Identifier: Apache-2.0
#include "alidade/base/text.h"

namespace alidade::internal {

std::string Join(const std::vector<std::string>& parts, const char* separator) {
  std::string text;
  for (std::size_t i = 0; i < parts.size(); ++i)
    text.append(i > 0 ? separator : "").append(parts[i]);
  return text;
}

std::string WithArticle(const std::string& noun) {
  // `unit_quaternion` begins with a consonant sound, /j/.
  const bool has_vowel = noun.find_first_of("aeiou") == 0 && !noun.starts_with("uni");
  return (has_vowel ? "an " : "a ") + noun;
}

std::string LowerCase(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

std::string ShellWord(const std::string& text) {
  constexpr const char* kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
      "%+,-./:=@_";
  if (!text.empty() && text.find_first_not_of(kPlain) == text.npos) return text;
  std::string word = "'";
  for (const char c : text) c == '\'' ? word += "'\\''" : word += c;
  return word + '\'';
}

}  // namespace alidade::internal
