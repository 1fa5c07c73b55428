// SPDX-License-Identifier: Apache-2.0
#include "json.h"

#include <cmath>

#include "alidade/error.h"
#include "number_text.h"

namespace alidade::internal {
namespace {

/// Bytes of the UTF-8 sequence at the front of `text`, 0 where there is none. (RFC 3629)
std::size_t Utf8Length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte(0);
  if (lead < 0x80) return 1;
  const std::size_t length = lead < 0xC2   ? 0
                             : lead < 0xE0 ? 2
                             : lead < 0xF0 ? 3
                             : lead < 0xF5 ? 4
                                           : 0;
  if (length == 0 || text.size() < length) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return 0;
  }
  const bool overlong = (lead == 0xE0 && byte(1) < 0xA0) || (lead == 0xF0 && byte(1) < 0x90);
  const bool surrogate = lead == 0xED && byte(1) >= 0xA0;
  const bool beyond = lead == 0xF4 && byte(1) >= 0x90;
  return overlong || surrogate || beyond ? 0 : length;
}

void AppendControl(std::string& text, char c) {
  constexpr std::string_view kHex = "0123456789abcdef";
  switch (c) {
    case '\n':
      text += "\\n";
      return;
    case '\t':
      text += "\\t";
      return;
    case '\r':
      text += "\\r";
      return;
    default:
      break;
  }
  const auto code = static_cast<unsigned char>(c);
  text += "\\u00";
  text += kHex[code >> 4];
  text += kHex[code & 15];
}

}  // namespace

std::string JsonQuoted(std::string_view value) {
  std::string text = "\"";
  while (!value.empty()) {
    const std::size_t length = Utf8Length(value);
    const char c = value[0];
    if (length == 0) {
      text += "\xEF\xBF\xBD";
    } else if (c == '"' || c == '\\') {
      text += '\\';
      text += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      AppendControl(text, c);
    } else {
      text += value.substr(0, length);
    }
    value.remove_prefix(length == 0 ? 1 : length);
  }
  return text += '"';
}

void Json::NewLine() {
  text_ += '\n';
  text_.append(2 * levels_.size(), ' ');
}

void Json::Item() {
  if (after_key_) {
    after_key_ = false;
    return;
  }
  if (levels_.empty()) return;
  if (!levels_.back().empty) text_ += ',';
  levels_.back().empty = false;
  NewLine();
}

Json& Json::Open(char open, char close) {
  Item();
  text_ += open;
  levels_.push_back({close});
  return *this;
}

Json& Json::Object() { return Open('{', '}'); }

Json& Json::Array() { return Open('[', ']'); }

Json& Json::End() {
  ALIDADE_EXPECTS(!levels_.empty() && !after_key_);
  const Level level = levels_.back();
  levels_.pop_back();
  if (!level.empty) NewLine();
  text_ += level.close;
  if (levels_.empty()) text_ += '\n';
  return *this;
}

Json& Json::Key(std::string_view key) {
  ALIDADE_EXPECTS(!levels_.empty() && levels_.back().close == '}' && !after_key_);
  Item();
  text_ += JsonQuoted(key);
  text_ += ": ";
  after_key_ = true;
  return *this;
}

Json& Json::Raw(std::string_view text) {
  ALIDADE_EXPECTS(after_key_ || (!levels_.empty() && levels_.back().close == ']'));
  Item();
  text_ += text;
  return *this;
}

Json& Json::Number(double value) { return Raw(std::isfinite(value) ? NumberText(value) : "null"); }

Json& Json::Integer(std::int64_t value) { return Raw(std::to_string(value)); }

Json& Json::Flag(bool value) { return Raw(value ? "true" : "false"); }

Json& Json::Text(std::string_view value) { return Raw(JsonQuoted(value)); }

const std::string& Json::text() const {
  ALIDADE_EXPECTS(levels_.empty() && !text_.empty());
  return text_;
}

}  // namespace alidade::internal
