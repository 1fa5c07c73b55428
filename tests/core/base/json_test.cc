// SPDX-License-Identifier: Apache-2.0
#include "alidade/base/json.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "alidade/base/error.h"
#include "alidade/base/number_text.h"

namespace alidade::internal {
namespace {

TEST(Json, WritesNestedValues) {
  Json json;
  json.Object();
  json.Key("a").Number(0.1).Key("b").Array().Integer(-3).Flag(true).Text("x").End();
  json.Key("c").Object().End().Key("d").Array().End();
  json.End();
  EXPECT_EQ(json.text(),
            "{\n  \"a\": 0.1,\n  \"b\": [\n    -3,\n    true,\n    \"x\"\n  ],\n"
            "  \"c\": {},\n  \"d\": []\n}\n");
}

TEST(Json, WritesWhatIsNotFiniteAsNull) {
  const double inf = std::numeric_limits<double>::infinity();
  Json json;
  json.Array().Number(inf).Number(-inf).Number(std::nan("")).End();
  EXPECT_EQ(json.text(), "[\n  null,\n  null,\n  null\n]\n");
}

TEST(Json, EscapesTexts) {
  EXPECT_EQ(JsonQuoted("a\"b\\c\n\t\r\x01"), "\"a\\\"b\\\\c\\n\\t\\r\\u0001\"");
  EXPECT_EQ(JsonQuoted("\xC3\xA9 \xE6\xB7\xB1 \xF0\x9F\x93\x90"),
            "\"\xC3\xA9 \xE6\xB7\xB1 \xF0\x9F\x93\x90\"");
}

TEST(Json, ReplacesWhatIsNoUtf8) {
  const std::string bad = "\xEF\xBF\xBD";
  EXPECT_EQ(JsonQuoted("a\xFF"), "\"a" + bad + "\"");                    // never a byte of UTF-8
  EXPECT_EQ(JsonQuoted("\xC3"), "\"" + bad + "\"");                      // cut short
  EXPECT_EQ(JsonQuoted("\xC0\xAF"), "\"" + bad + bad + "\"");            // overlong
  EXPECT_EQ(JsonQuoted("\xED\xA0\x80"), "\"" + bad + bad + bad + "\"");  // surrogate
}

TEST(Json, RefusesMisuse) {
  EXPECT_THROW(Json().Key("a"), ContractViolation);
  EXPECT_THROW(Json().End(), ContractViolation);
  EXPECT_THROW(Json().Object().Number(1.0), ContractViolation);  // a value without a key
  EXPECT_THROW(Json().Array().Key("a"), ContractViolation);
  EXPECT_THROW(Json().Object().Key("a").End(), ContractViolation);
  EXPECT_THROW(static_cast<void>(Json().Object().text()), ContractViolation);
}

TEST(NumberText, IsTheShortestThatReadsBack) {
  EXPECT_EQ(NumberText(0.1), "0.1");
  EXPECT_EQ(NumberText(1e-5), "1e-05");
  EXPECT_EQ(NumberText(-0.0), "-0");
  EXPECT_EQ(NumberText(1.0 / 3.0), "0.3333333333333333");
  EXPECT_EQ(NumberText(-std::nan("")), "nan");
  EXPECT_EQ(NumberText(-std::numeric_limits<double>::infinity()), "-inf");
}

TEST(RoundedText, HasAFewDigits) {
  EXPECT_EQ(RoundedText(0.0234567, 4), "0.02346");
  EXPECT_EQ(RoundedText(21.0, 4), "21");
  EXPECT_EQ(RoundedText(1.5e9, 4), "1.5e+09");
}

TEST(Seconds, AreExactToTheNanosecond) {
  const auto text = [](Stamp stamp) {
    std::string seconds;
    AppendSeconds(seconds, stamp);
    return seconds;
  };
  EXPECT_EQ(text(0), "0.000000000");
  EXPECT_EQ(text(33'000'000), "0.033000000");
  EXPECT_EQ(text(-1), "-0.000000001");
  EXPECT_EQ(text(1'700'000'000'123'456'789), "1700000000.123456789");  // a double has 16 digits
  EXPECT_EQ(text(INT64_MAX), "9223372036.854775807");
  EXPECT_EQ(text(INT64_MIN), "-9223372036.854775808");
}

}  // namespace
}  // namespace alidade::internal
