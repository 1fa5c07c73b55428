// SPDX-License-Identifier: Apache-2.0
#include "alidade/config/config.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "alidade/config/read_covariance.h"
#include "support/comma_locale.h"
#include "support/config_text.h"

namespace alidade {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

using testing::Message;
using testing::Read;

/// Calls `read` on the value of `v`. Returns the error message without the prefix `f.yaml:1:4 v: `.
template <class Reader>
std::string MessageOf(const std::string& value, const Reader& read) {
  const Config config = Read("v: " + value);
  const std::string message = Message([&] { read(config.root().At("v")); });
  const std::string place = "f.yaml:1:4 v: ";
  return message.starts_with(place) ? message.substr(place.size()) : message;
}

std::string NumberError(const std::string& value) {
  return MessageOf(value, [](const Node& node) { return node.Number(); });
}

double NumberOf(const std::string& value) { return Read("v: " + value).root().At("v").Number(); }

TEST(ErrorLine, LeavesOutEmptyParts) {
  EXPECT_EQ(ErrorLine({"f.yaml", 3, 5}, "a.b", "'x'", "a number", "y"),
            "f.yaml:3:5 a.b: 'x'; expected a number; did you mean 'y'?");
  EXPECT_EQ(ErrorLine({"f.yaml"}, "", "is empty"), "f.yaml: is empty");
  EXPECT_EQ(ErrorLine({}, "a", "is empty"), "a: is empty");
  EXPECT_EQ(ErrorLine({}, "", "is empty"), "is empty");
  EXPECT_EQ(ErrorLine({"--set"}, "a", "'x'", "expected a number"),
            "--set a: 'x'; expected a number");
}

TEST(EditDistance, CountsTranspositionsOnce) {
  EXPECT_EQ(EditDistance("", "abc"), 3);
  EXPECT_EQ(EditDistance("sigma", "sigma"), 0);
  EXPECT_EQ(EditDistance("simga", "sigma"), 1);
  EXPECT_EQ(EditDistance("kitten", "sitting"), 3);
}

TEST(Nearest, IsEmptyWhereNothingIsNear) {
  const std::vector<std::string> words = {"focal_px", "baseline_m"};
  EXPECT_EQ(Nearest("focla_px", words), "focal_px");
  EXPECT_EQ(Nearest("seed", words), "");
}

TEST(Nearest, DoesNotDependOnTheCase) {
  const std::vector<std::string> words = {"iekf", "ukf"};
  EXPECT_EQ(Nearest("UKF", words), "ukf");
}

TEST(Nearest, FindsAbbreviations) {
  const std::vector<std::string> words = {"sigma_px", "target.depth", "heading", "focal_px"};
  EXPECT_EQ(Nearest("sigma", words), "sigma_px");
  EXPECT_EQ(Nearest("depth", words), "target.depth");
  EXPECT_EQ(Nearest("hdg", words), "heading");
  EXPECT_EQ(Nearest("focal_length_px", words), "focal_px");
  EXPECT_EQ(Nearest("px", words), "");            // too short
  EXPECT_EQ(Nearest("length_depth", words), "");  // its letters occur in none of the words
  // A typing error is more probable than an abbreviation.
  EXPECT_EQ(Nearest("rate", std::vector<std::string>{"rate_limit_hz", "rates"}), "rates");
}

TEST(Expects, ThrowsContractViolation) {
  EXPECT_NO_THROW(ALIDADE_EXPECTS(1 + 1 == 2));
  EXPECT_THROW(ALIDADE_EXPECTS(1 + 1 == 3), ContractViolation);
}

TEST(Node, NumberReadsPlainDecimals) {
  EXPECT_EQ(NumberOf("0"), 0.0);
  EXPECT_EQ(NumberOf("0.5"), 0.5);
  EXPECT_EQ(NumberOf("-0.25"), -0.25);
  EXPECT_EQ(NumberOf("+3"), 3.0);
  EXPECT_EQ(NumberOf(".5"), 0.5);
  EXPECT_EQ(NumberOf("5."), 5.0);
  EXPECT_EQ(NumberOf("1e-05"), 1e-5);
  EXPECT_EQ(NumberOf("6.02E+23"), 6.02e23);
  EXPECT_EQ(NumberOf("0e400"), 0.0);
  EXPECT_EQ(NumberOf("5e-324"), std::numeric_limits<double>::denorm_min());
}

TEST(Node, NumberRefusesTrailingText) {
  EXPECT_EQ(Message([] { Read("a: 1\nb: {c: 3.8x}").root().At("b").At("c").Number(); }),
            "f.yaml:2:8 b.c: '3.8x' is not a finite number; expected a number");
  for (const char* text : {"3.8 pt", "1_000", "0x10", "1e", "1e+", "--1", "+-1", ".", "1,5"}) {
    EXPECT_NE(NumberError(text).find("is not a finite number"), std::string::npos) << text;
  }
}

TEST(Node, NumberRefusesNanAndInfinity) {
  for (const char* text : {".nan", ".inf", "-.inf", "nan", "inf", "-inf", "infinity"}) {
    EXPECT_EQ(NumberError(text),
              "'" + std::string(text) + "' is not a finite number; expected a number");
  }
}

TEST(Node, NumberRefusesUnderflowAndOverflow) {
  for (const char* text : {"1e-400", "1e400", "-1e400", "1e-99999999999", "1e99999999999"}) {
    EXPECT_EQ(NumberError(text),
              "'" + std::string(text) +
                  "' is too large or too small to be represented; expected a number");
  }
}

TEST(Node, NumberRefusesLeadingZeros) {
  for (const char* text : {"010", "-007", "00", "00.5"}) {
    EXPECT_EQ(NumberError(text),
              "'" + std::string(text) + "' has a leading zero; expected a number");
  }
}

TEST(Node, NumberRefusesOtherKinds) {
  EXPECT_EQ(NumberError("\"400\""), "the quoted text '400'; expected a number");
  EXPECT_EQ(NumberError("[1]"), "a list; expected a number");
  EXPECT_EQ(NumberError("{a: 1}"), "a map; expected a number");
  EXPECT_EQ(NumberError("~"), "no value; expected a number");
}

TEST(Node, ValueLeftOutIsPlacedAtItsKey) {
  EXPECT_EQ(Message([] { Read("a:\nb: 1").root().At("a").Number(); }),
            "f.yaml:1:1 a: no value; expected a number");
}

TEST(Node, NumberIsReadTheSameInACommaLocale) {
  const testing::CommaLocale comma;
  if (!comma.active()) GTEST_SKIP() << "localedef is not available";
  EXPECT_EQ(NumberOf("0.5"), 0.5);
}

TEST(Node, NumberOutOfRangeNamesTheRange) {
  const auto error = [](const char* text, double low, double high, bool low_open, bool high_open) {
    return MessageOf(text, [=](const Node& n) { return n.Number(low, high, low_open, high_open); });
  };
  EXPECT_EQ(error("-1", 0, kInfinity, false, false),
            "'-1' is out of range; expected a number >= 0");
  EXPECT_EQ(error("0", 0, kInfinity, true, false), "'0' is out of range; expected a number > 0");
  EXPECT_EQ(error("0", 0, 1, true, true), "'0' is out of range; expected a number in (0, 1)");
  EXPECT_EQ(error("1", 0, 1, false, true), "'1' is out of range; expected a number in [0, 1)");
  EXPECT_EQ(error("2", -kInfinity, 1.5, false, false),
            "'2' is out of range; expected a number <= 1.5");
  EXPECT_EQ(error("x", 0, 1, false, false),
            "'x' is not a finite number; expected a number in [0, 1]");
  EXPECT_EQ(error("0", 0, 1, false, false), "no error");
}

TEST(Node, IntegerIsWholeAndInRange) {
  const auto error = [](const std::string& text) {
    return MessageOf(text, [](const Node& node) { return node.Integer(1, 640); });
  };
  EXPECT_EQ(Read("v: -9223372036854775808").root().At("v").Integer(INT64_MIN, INT64_MAX),
            INT64_MIN);
  EXPECT_EQ(error("640"), "no error");
  EXPECT_EQ(error("641"), "'641' is out of range; expected an integer in [1, 640]");
  EXPECT_EQ(error("9223372036854775808"),
            "'9223372036854775808' is out of range; expected an integer in [1, 640]");
  EXPECT_EQ(error("3.0"), "'3.0' is not an integer; expected an integer in [1, 640]");
  EXPECT_EQ(error("010"), "'010' has a leading zero; expected an integer in [1, 640]");
}

TEST(Node, FlagIsTrueOrFalseAlone) {
  const auto error = [](const std::string& text) {
    return MessageOf(text, [](const Node& node) { return node.Flag(); });
  };
  EXPECT_TRUE(Read("v: true").root().At("v").Flag());
  EXPECT_FALSE(Read("v: false").root().At("v").Flag());
  EXPECT_EQ(error("yes"), "'yes'; expected true or false; did you mean 'true'?");
  EXPECT_EQ(error("on"), "'on'; expected true or false; did you mean 'true'?");
  EXPECT_EQ(error("no"), "'no'; expected true or false; did you mean 'false'?");
  EXPECT_EQ(error("off"), "'off'; expected true or false; did you mean 'false'?");
  EXPECT_EQ(error("True"), "'True'; expected true or false; did you mean 'true'?");
  EXPECT_EQ(error("'true'"), "the text 'true'; expected true or false; did you mean 'true'?");
}

TEST(Node, ChoiceListsWhatIsAccepted) {
  const auto read = [](const Node& node) { return node.Choice({"skip", "disable", "abort"}); };
  EXPECT_EQ(read(Read("v: abort").root().At("v")), 2);
  EXPECT_EQ(MessageOf("abrot", read),
            "'abrot'; expected one of skip, disable, abort; did you mean 'abort'?");
}

TEST(Node, NumbersHaveTheLengthAsked) {
  EXPECT_EQ(Read("v: [1, 2]").root().At("v").Numbers(2), (std::vector<double>{1, 2}));
  EXPECT_EQ(Read("v: 3").root().At("v").Numbers(), std::vector<double>{3});
  const auto read = [](const Node& node) { return node.Numbers(3); };
  EXPECT_EQ(MessageOf("[1, 2]", read), "has 2 items; expected 3");
  EXPECT_EQ(MessageOf("1", read), "has 1 item; expected 3");
  EXPECT_EQ(MessageOf("[1, x, 3]", read),
            "f.yaml:1:8 v[1]: 'x' is not a finite number; expected a number");
  EXPECT_EQ(MessageOf("[]", [](const Node& node) { return node.Numbers(); }),
            "the list is empty; expected at least one number");
}

TEST(ReadCovariance, IsSquareSymmetricAndPositive) {
  const auto error = [](const std::string& text) {
    return MessageOf(text, [](const Node& node) { return internal::ReadCovariance(node, 2); });
  };
  EXPECT_EQ(internal::ReadCovariance(Read("v: [[4, 1], [1, 2]]").root().At("v"), 2),
            (std::vector<double>{4, 1, 1, 2}));
  EXPECT_EQ(error("[[1, 1], [1, 1]]"), "no error");
  EXPECT_EQ(error("[[0, 0], [0, 1e-20]]"), "no error");
  EXPECT_EQ(error("[1, 2]"), "f.yaml:1:5 v[0]: not a row of numbers; expected 2 rows of 2 numbers");
  EXPECT_EQ(error("[[1, 0]]"), "has 1 item; expected 2 rows of 2 numbers");
  EXPECT_EQ(error("[[1, 0], [0]]"), "f.yaml:1:13 v[1]: has 1 item; expected 2");
  EXPECT_EQ(error("[[1, 0.5], [0.25, 1]]"),
            "not symmetric: [0][1] is 0.5, but [1][0] is 0.25; expected a symmetric matrix");
  // The eigenvalues of [[1, 2], [2, 1]] are 3 and -1.
  EXPECT_EQ(error("[[1, 2], [2, 1]]"),
            "not positive semi-definite: its smallest eigenvalue is -1; expected a covariance");
  // A negative eigenvalue is also found if the variances differ by many orders of magnitude.
  const std::string mixed = "[[1e6, 0, 0], [0, 1e-14, 2e-14], [0, 2e-14, 1e-14]]";
  EXPECT_EQ(MessageOf(mixed, [](const Node& node) { return internal::ReadCovariance(node, 3); }),
            "not positive semi-definite: its smallest eigenvalue is -1e-14; expected a covariance");
  // The first variance is zero, so the covariance of the two elements must be zero too. The
  // eigenvalues are 1 and -1e-18.
  EXPECT_EQ(error("[[0, 1e-9], [1e-9, 1]]"),
            "not positive semi-definite: its smallest eigenvalue is -1e-18; expected a covariance");
  // A negative variance is found even if it is far below the rounding error of the other variance.
  EXPECT_EQ(error("[[1e6, 0], [0, -1e-18]]"),
            "not positive semi-definite: its smallest eigenvalue is -1e-18; expected a covariance");
}

TEST(Node, UnknownKeyNamesTheNearestOne) {
  const Config config = Read("alidade: 1\nstereo:\n  focla_px: 400\n  sigma_px: 1\n  seed: 2\n");
  const Node stereo = config.root().At("stereo");
  stereo.Find("focal_px");
  stereo.At("sigma_px");
  EXPECT_EQ(Message([&] { stereo.RejectUnread(); }),
            "f.yaml:3:3 stereo.focla_px: unknown key; did you mean 'focal_px'?\n"
            "f.yaml:5:3 stereo.seed: unknown key; expected one of focal_px, sigma_px");
  stereo.Declare("focla_px");
  stereo.Declare("seed");
  EXPECT_NO_THROW(stereo.RejectUnread());
}

TEST(Node, UnknownKeyListsTheKeysThatTheMapContains) {
  const Config config = Read("{focal_px: 400, sigma: 2, x: 1}");
  for (const char* key : {"focal_px", "covariance", "sigma_px"}) config.root().Find(key);
  EXPECT_EQ(Message([&] { config.root().RejectUnread(); }),
            "f.yaml:1:17 sigma: unknown key; did you mean 'sigma_px'?\n"
            "f.yaml:1:27 x: unknown key; expected one of covariance, focal_px, sigma_px");
}

TEST(Node, AMapIsShownByAnExample) {
  const Config config = Read("a: 1\nb: {c: 1}");
  EXPECT_EQ(Message([&] { config.root().At("a").ExpectMap("{mean: 0, sigma: 1}"); }),
            "f.yaml:1:4 a: '1'; expected a map, as in {mean: 0, sigma: 1}");
  EXPECT_NO_THROW(config.root().At("b").ExpectMap("{c: 1}"));
}

TEST(Node, ANumberWithAUnitIsConverted) {
  const Config config =
      Read("{baseline_m: 65mm, rate_deg_s: 1rad/s, rate: 3deg, sigma: 5 s, list: [1cm], size: 5x}");
  const auto error = [&](const char* key, const char* unit) {
    return Message([&] { config.root().At(key).Number(0.0, 10.0, true, false, unit); });
  };
  EXPECT_EQ(error("baseline_m", ""),
            "f.yaml:1:14 baseline_m: '65mm' contains a unit; expected a number in (0, 10] (m), "
            "without a unit: 0.065");
  EXPECT_EQ(error("rate_deg_s", ""),
            "f.yaml:1:32 rate_deg_s: '1rad/s' contains a unit; expected a number in (0, 10] "
            "(deg/s), without a unit: 57.2957795");
  EXPECT_EQ(error("rate", ""),
            "f.yaml:1:46 rate: '3deg' contains a unit; expected a number in (0, 10] (rad), without "
            "a unit: 0.0523598776");
  // Seconds cannot be converted to pixels.
  EXPECT_EQ(error("sigma", "px"),
            "f.yaml:1:59 sigma: '5 s' contains a unit; expected a number in (0, 10] (px), without "
            "a unit");
  EXPECT_EQ(Message([&] { config.root().At("list").Numbers(-1, "m"); }),
            "f.yaml:1:71 list[0]: '1cm' contains a unit; expected a number (m), without a unit: "
            "0.01");
  EXPECT_EQ(error("size", "px"),
            "f.yaml:1:83 size: '5x' is not a finite number; expected a number in (0, 10] (px)");
}

TEST(Node, AProbabilityAboveOneIsExplained) {
  const auto error = [](const char* value) {
    const Config config = Read("gate: " + std::string(value));
    return Message([&] { config.root().At("gate").Number(0.0, 1.0, true, true); });
  };
  const std::string expected = "; expected a number in (0, 1)";
  EXPECT_EQ(error("99.9"), "f.yaml:1:7 gate: '99.9' is out of range: 99.9 % is 0.999" + expected);
  EXPECT_EQ(error("3"),
            "f.yaml:1:7 gate: '3' is out of range: 3 % is 0.03, and the probability of 3 sigma is "
            "0.9973" +
                expected);
  EXPECT_EQ(error("1"), "f.yaml:1:7 gate: '1' is out of range" + expected);
  EXPECT_EQ(error("300"), "f.yaml:1:7 gate: '300' is out of range" + expected);
}

TEST(Node, MissingKeyNamesWhoNeedsIt) {
  const Config config =
      Read("sensors:\n  stereo:\n    model: stereo_disparity\n    focla_px: 400\n");
  const Node stereo = config.root().At("sensors").At("stereo");
  EXPECT_EQ(Message([&] { stereo.At("baseline_m", "stereo_disparity"); }),
            "f.yaml:2:3 sensors.stereo.baseline_m: missing key, needed by stereo_disparity");
  EXPECT_EQ(Message([&] { stereo.At("focal_px"); }),
            "f.yaml:2:3 sensors.stereo.focal_px: missing key; found 'focla_px' at line 4; did you "
            "mean 'focal_px'?");
  EXPECT_EQ(Message([&] { stereo.At("roles", "a sensor", "roles: {ROLE: BLOCK}"); }),
            "f.yaml:2:3 sensors.stereo.roles: missing key, needed by a sensor; expected roles: "
            "{ROLE: BLOCK}");
  EXPECT_EQ(Message([&] { config.root().At("source"); }), "f.yaml:1:1 source: missing key");
}

TEST(Node, WrongUnitNamesTheRightOne) {
  const Config config = Read("{baseline_mm: 65, rate_deg_s: 1, sigma_m: 2}");
  const Node root = config.root();
  EXPECT_EQ(Message([&] { root.At("baseline_m", "stereo_disparity"); }),
            "f.yaml:1:2 baseline_mm: wrong unit 'mm'; expected baseline_m");
  EXPECT_EQ(Message([&] { root.At("rate_rad_s"); }),
            "f.yaml:1:19 rate_deg_s: wrong unit 'deg_s'; expected rate_rad_s");
  // Pixels cannot be converted to metres. sigma_m may be a key that the program reads later.
  EXPECT_EQ(Message([&] { root.At("sigma_px"); }),
            "f.yaml:1:1 sigma_px: missing key; found 'sigma_m' at line 1; did you mean "
            "'sigma_px'?");
  const std::string rejected = Message([&] { root.RejectUnread(); });
  EXPECT_NE(rejected.find("f.yaml:1:34 sigma_m: wrong unit 'm'; expected sigma_px"),
            std::string::npos);
}

TEST(Node, EveryUnitIsKnownForOneOfItsQuantity) {
  const std::vector<std::vector<std::string>> quantities = {
      {"m", "mm", "cm", "km", "um", "nm", "in", "inch", "ft"},
      {"s", "sec", "ms", "us", "ns", "h"},
      {"rad", "deg", "mrad"},
      {"hz", "khz", "mhz"},
      {"px", "pixel", "pixels"},
      {"m2", "mm2", "cm2"},
      {"s2", "ms2"},
      {"rad2", "deg2"},
      {"kg", "g"}};
  for (const std::vector<std::string>& units : quantities) {
    const std::string known = "rate_" + units[0];
    for (std::size_t i = 1; i < units.size(); ++i) {
      const std::string written = "rate_" + units[i];
      const Config config = Read(written + ": 1");
      EXPECT_EQ(Message([&] { config.root().At(known); }),
                "f.yaml:1:1 " + written + ": wrong unit '" + units[i] + "'; expected " + known);
    }
  }
}

// A key with a unit of another quantity may be a different key. It is an error only if the program
// does not read this key.
TEST(Node, UnitsOfDifferentQuantitiesDoNotConvert) {
  const std::vector<std::string> units = {"m",  "s",   "rad",  "hz", "px",     "m2",
                                          "s2", "px2", "rad2", "kg", "percent"};
  for (const std::string& unit : units) {
    for (const std::string& other : units) {
      if (unit == other) continue;
      const std::string written = "rate_" + unit, known = "rate_" + other;
      const Config config = Read(written + ": 1");
      const std::string missing = Message([&] { config.root().At(known); });
      EXPECT_TRUE(missing.starts_with("f.yaml:1:1 " + known + ": missing key")) << missing;
      EXPECT_EQ(Message([&] { config.root().RejectUnread(); }),
                "f.yaml:1:1 " + written + ": wrong unit '" + unit + "'; expected " + known);
    }
  }
}

TEST(Node, MinimumIsNoUnit) {
  const Config config = Read("depth_min: 1");
  config.root().Find("depth_m");
  EXPECT_EQ(Message([&] { config.root().RejectUnread(); }),
            "f.yaml:1:1 depth_min: unknown key; did you mean 'depth_m'?");
}

TEST(Node, EntriesCountAsRead) {
  const Config config = Read("b: 1\na: 2\n");
  const auto entries = config.root().Entries();
  ASSERT_EQ(entries.size(), 2u);
  EXPECT_EQ(entries[0].first, "b");
  EXPECT_NO_THROW(config.root().RejectUnread());
}

TEST(Node, PathNamesKeysAndItems) {
  const Config config = Read("source: {columns: [a, [b, c]]}");
  const Node inner = config.root().At("source").At("columns").Items()[1].Items()[0];
  EXPECT_EQ(inner.path(), "source.columns[1][0]");
  EXPECT_EQ(config.root().path(), "");
  EXPECT_EQ(ToString(inner.place()), "f.yaml:1:24");
}

TEST(Node, AnythingButAListCountsAsAListOfOne) {
  const Config config = Read("a: [1, 2]\nb: 3\nc: []");
  const auto paths = [&](const char* key) {
    std::vector<std::string> found;
    for (const Node& item : config.root().At(key).ItemsOrOne()) found.push_back(item.path());
    return found;
  };
  EXPECT_EQ(paths("a"), (std::vector<std::string>{"a[0]", "a[1]"}));
  EXPECT_EQ(paths("b"), std::vector<std::string>{"b"});
  EXPECT_TRUE(paths("c").empty());
}

TEST(Node, WrongKindSaysWhatIsThere) {
  const Config config = Read("a: text\nb: [1]\nc:\n");
  const Node root = config.root();
  EXPECT_EQ(Message([&] { root.At("a").Find("x"); }), "f.yaml:1:4 a: 'text'; expected a map");
  EXPECT_EQ(Message([&] { root.At("b").Text(); }), "f.yaml:2:4 b: a list; expected text");
  EXPECT_EQ(Message([&] { root.At("c").Items(); }), "f.yaml:3:1 c: no value; expected a list");
  EXPECT_EQ(Message([&] { root.At("a").Items(); }),
            "f.yaml:1:4 a: 'text'; expected a list, as in [text]");
}

TEST(Node, LongAndBinaryTextIsShownShort) {
  const std::string message = NumberError("\"" + std::string(5000, 'x') + "\"");
  EXPECT_LT(message.size(), 200u);
  EXPECT_EQ(NumberError(R"("a\e[31m\nb")"), R"(the quoted text 'a\x1b[31m\nb'; expected a number)");
}

}  // namespace
}  // namespace alidade
