// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace alidade::internal {

/// Writes one JSON text, two spaces for each level, numbers in the shortest form that reads back.
///
///   Json json;
///   json.Object();
///   json.Key("rmse").Number(0.002);
///   json.End();
///   json.text();                      // {\n  "rmse": 0.002\n}\n
class Json {
 public:
  Json& Object();
  Json& Array();
  /// Ends the innermost object or array; an empty one stays on its line.
  Json& End();
  Json& Key(std::string_view key);

  Json& Number(double value);  ///< null where it is not finite
  Json& Integer(std::int64_t value);
  Json& Flag(bool value);
  Json& Text(std::string_view value);

  /// The whole text. Requires that all is ended.
  const std::string& text() const;

 private:
  struct Level {
    char close;
    bool empty = true;
  };
  /// Comma, line and indent before an item.
  void Item();
  void NewLine();
  Json& Open(char open, char close);
  Json& Raw(std::string_view text);

  std::string text_;
  std::vector<Level> levels_;
  bool after_key_ = false;
};

/// `value` as a JSON string with its quotes; bytes that are no UTF-8 become U+FFFD.
std::string JsonQuoted(std::string_view value);

}  // namespace alidade::internal
