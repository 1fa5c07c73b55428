// SPDX-License-Identifier: Apache-2.0
#include "alidade/base/json.h"

#include <cmath>

#include "alidade/base/error.h"
#include "alidade/base/number_text.h"
#include "alidade/base/utf8.h"

namespace alidade::internal {
namespace {

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
