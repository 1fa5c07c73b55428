// SPDX-License-Identifier: Apache-2.0
#include "alidade/io/wrap_text.h"

#include <algorithm>

#include "alidade/io/utf8.h"

namespace alidade::internal {
namespace {

std::size_t HangingIndent(std::string_view line, std::size_t width, std::size_t additional) {
  const std::size_t leading = std::min(line.find_first_not_of(' '), line.size());
  std::size_t indent = leading + additional;
  std::size_t gap = line.find("  ", leading);
  while (gap != line.npos) {
    const std::size_t column = line.find_first_not_of(' ', gap);
    if (column == line.npos || column > width / 2) break;
    indent = column;
    gap = line.find("  ", column);
  }
  return indent;
}

void AppendWrapped(std::string_view line, std::size_t width, std::size_t additional,
                   std::string& text) {
  const std::size_t indent = HangingIndent(line, width, additional);
  std::size_t used = 0, offset = 0;
  while (offset < line.size()) {
    const std::size_t word = line.find_first_not_of(' ', offset);
    if (word == line.npos) return;
    const std::size_t end = std::min(line.find(' ', word), line.size());
    const std::string_view piece = line.substr(offset, end - offset);
    if (offset > indent && used + TextWidth(piece) > width) {
      text.append("\n").append(indent, ' ').append(line.substr(word, end - word));
      used = indent + TextWidth(line.substr(word, end - word));
    } else {
      text += piece;
      used += TextWidth(piece);
    }
    offset = end;
  }
}

}  // namespace

std::string WrapText(std::string_view text, std::size_t width, std::size_t indent) {
  std::string wrapped;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    if (TextWidth(line) <= width) {
      wrapped += line;
    } else {
      AppendWrapped(line, width, indent, wrapped);
    }
    if (end < text.size()) wrapped += '\n';
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return wrapped;
}

}  // namespace alidade::internal
