// SPDX-License-Identifier: Apache-2.0
#include "alidade/io/json.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "alidade/base/error.h"

namespace alidade::internal {
namespace {

std::string JsonFault(std::string_view text) {
  try {
    ParseJson(text, "a.json");
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::kBadData);
    return error.what();
  }
  return "";
}

TEST(JsonText, KeepsTheOrderOfKeysAndIndentsByTwo) {
  const Json json = {
      {"b", 0.1}, {"a", {-3, true, "x"}}, {"c", Json::object()}, {"d", Json::array()}};
  EXPECT_EQ(JsonText(json),
            "{\n  \"b\": 0.1,\n  \"a\": [\n    -3,\n    true,\n    \"x\"\n  ],\n"
            "  \"c\": {},\n  \"d\": []\n}\n");
}

TEST(JsonText, WritesWhatIsNotFiniteAsNull) {
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(JsonText({inf, -inf, std::nan("")}), "[\n  null,\n  null,\n  null\n]\n");
}

TEST(JsonText, WritesNumbersThatReadBack) {
  for (const double value : {0.1, 1.0 / 3.0, 5e-324, 1.7976931348623157e308, -2.5e-17, 1e21, 1.0}) {
    const std::string text = JsonText(value);
    EXPECT_EQ(ParseJson(text, "").get<double>(), value) << text;
  }
  EXPECT_EQ(JsonText(1.0), "1.0\n");  // a double always has a decimal point
  EXPECT_EQ(JsonText(std::uint64_t{18446744073709551615u}), "18446744073709551615\n");
}

TEST(JsonText, ReplacesWhatIsNotUtf8) {
  EXPECT_EQ(JsonText("a\xFF"), "\"a\xEF\xBF\xBD\"\n");
  EXPECT_EQ(JsonText("\xC3"), "\"\xEF\xBF\xBD\"\n");  // the UTF-8 character is truncated
  EXPECT_EQ(JsonText("\xC3\xA9 \"\\\n\x01"), "\"\xC3\xA9 \\\"\\\\\\n\\u0001\"\n");
  EXPECT_EQ(JsonText({{"k\xFF", 1}}), "{\n  \"k\xEF\xBF\xBD\": 1\n}\n");
}

TEST(ParseJson, NamesThePlaceOfAFault) {
  const std::string error = "syntax error while parsing ";
  EXPECT_EQ(JsonFault("{\"a\": "),
            "a.json:1:7: " + error + "value - unexpected end of input; expected JSON");
  EXPECT_EQ(JsonFault("{\n  \"a\": 1,\n  x\n}"),
            "a.json:3:3: " + error + "object key - invalid literal; expected JSON");
  EXPECT_EQ(JsonFault(""),
            "a.json:1:1: " + error + "value - unexpected end of input; expected JSON");
  EXPECT_EQ(
      JsonFault("\"\xFF\""),
      "a.json:1:2: " + error + "value - invalid string: ill-formed UTF-8 byte; expected JSON");
  EXPECT_EQ(JsonFault("{\"a\": 1e999}"), "a.json: number overflow parsing '1e999'; expected JSON");
  EXPECT_EQ(JsonFault("{}\n"), "");
}

}  // namespace
}  // namespace alidade::internal
