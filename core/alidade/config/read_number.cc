// SPDX-License-Identifier: Apache-2.0
#include "alidade/config/read_number.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>

#include "alidade/base/number_text.h"
#include "alidade/config/unit.h"

namespace alidade::internal {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Returns the offset after the digits that start at `offset`.
std::size_t SkipDigits(std::string_view text, std::size_t offset) {
  while (offset < text.size() && IsDigit(text[offset])) ++offset;
  return offset;
}

/// Properties of a text with respect to the syntax [+-] digits [. digits] [e [+-] digits].
struct Decimal {
  bool is_valid = false;
  bool is_integer = false;
  bool has_leading_zero = false;
};

Decimal Scan(std::string_view text) {
  Decimal decimal;
  const std::size_t begin = !text.empty() && (text[0] == '-' || text[0] == '+') ? 1 : 0;
  const std::size_t whole_end = SkipDigits(text, begin);
  std::size_t end = whole_end;
  std::size_t digits = whole_end - begin;
  if (end < text.size() && text[end] == '.') {
    end = SkipDigits(text, whole_end + 1);
    digits += end - whole_end - 1;
  }
  if (digits == 0) return decimal;
  if (end < text.size() && (text[end] == 'e' || text[end] == 'E')) {
    std::size_t exponent = end + 1;
    if (exponent < text.size() && (text[exponent] == '-' || text[exponent] == '+')) ++exponent;
    end = SkipDigits(text, exponent);
    if (end == exponent) return decimal;
  }
  decimal.is_valid = end == text.size();
  decimal.is_integer = whole_end == text.size();
  decimal.has_leading_zero = whole_end - begin > 1 && text[begin] == '0';
  return decimal;
}

std::string Interval(const char* kind, double low, double high, bool low_open, bool high_open) {
  std::string text = kind;
  if (low == -kInfinity && high == kInfinity) return text;
  if (high == kInfinity) return text + (low_open ? " > " : " >= ") + NumberText(low);
  if (low == -kInfinity) return text + (high_open ? " < " : " <= ") + NumberText(high);
  return text + " in " + (low_open ? '(' : '[') + NumberText(low) + ", " + NumberText(high) +
         (high_open ? ')' : ']');
}

std::string WithUnit(const std::string& expected, std::string_view unit) {
  return unit.empty() ? expected : expected + " (" + std::string(unit) + ')';
}

/// Returns the number that the author probably meant by `value`, which is not in (0, 1): a
/// percentage, or the factor of a standard deviation. All numbers in (0, 1) are probabilities.
std::string ProbabilityText(double value) {
  constexpr double kMaxSigma = 9.0, kMaxPercent = 100.0;
  if (!(value > 1.0 && value < kMaxPercent)) return {};
  const std::string number = NumberText(value);
  std::string text = ": " + number + " % is " + RoundedText(value / kMaxPercent);
  if (value > kMaxSigma) return text;
  return text + ", and the probability of " + number + " sigma is " +
         RoundedText(std::erf(value / std::numbers::sqrt2));
}

/// Rejects a text that is not a decimal number. If the text is a number with a unit, the message
/// contains the number to write. `unit` is the unit of the value; if it is empty, the key may name
/// the unit.
[[noreturn]] void FailNotDecimal(const ConfigTree& tree, const std::string& expected,
                                 std::string_view unit) {
  const Node node(&tree);
  const auto quantity = ParseQuantity(tree.text);
  if (!quantity) node.Fail(Quoted(tree.text) + " is not a finite number", WithUnit(expected, unit));
  std::string name(unit);
  if (name.empty()) name = SplitUnit(tree.key).suffix;
  std::ranges::replace(name, '_', '/');
  std::optional<Unit> needed = ParseUnit(name);
  if (name.empty()) {
    name = quantity->unit.si;
    needed = Unit{quantity->unit.dimensions, 1.0, name};
  }
  std::string remedy = WithUnit(expected, name) + ", without a unit";
  if (needed && needed->dimensions == quantity->unit.dimensions)
    remedy += ": " + ConvertedText(*quantity, *needed);
  node.Fail(Quoted(tree.text) + " contains a unit", remedy);
}

/// Returns the text of an unquoted scalar without a leading '+'. Fails unless the scalar is a
/// decimal number. The error message contains `expected` and `unit`.
std::string_view DecimalText(const ConfigTree& tree, const std::string& expected,
                             std::string_view unit = {}) {
  const Node node(&tree);
  if (tree.kind == Node::Kind::kNull) node.Fail("no value", WithUnit(expected, unit));
  if (tree.kind == Node::Kind::kList) node.Fail("a list", WithUnit(expected, unit));
  if (tree.kind == Node::Kind::kMap) node.Fail("a map", WithUnit(expected, unit));
  const std::string_view text = tree.text;
  if (tree.quoted) node.Fail("the quoted text " + Quoted(text), WithUnit(expected, unit));
  const Decimal decimal = Scan(text);
  if (!decimal.is_valid) FailNotDecimal(tree, expected, unit);
  if (decimal.has_leading_zero)
    node.Fail(Quoted(text) + " has a leading zero", WithUnit(expected, unit));
  return text[0] == '+' ? text.substr(1) : text;
}

}  // namespace

double ReadNumber(const ConfigTree& tree, const std::string& expected, std::string_view unit) {
  const std::string_view text = DecimalText(tree, expected, unit);
  double value = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc()) {
    Node(&tree).Fail(Quoted(tree.text) + " is too large or too small to be represented",
                     WithUnit(expected, unit));
  }
  return value;
}

double ReadNumber(const ConfigTree& tree, double low, double high, bool low_open, bool high_open,
                  std::string_view unit) {
  const std::string expected = Interval("a number", low, high, low_open, high_open);
  const double value = ReadNumber(tree, expected, unit);
  if (value < low || value > high || (low_open && value == low) || (high_open && value == high)) {
    const bool is_probability = low == 0.0 && high == 1.0 && low_open && high_open;
    Node(&tree).Fail(
        Quoted(tree.text) + " is out of range" + (is_probability ? ProbabilityText(value) : ""),
        WithUnit(expected, unit));
  }
  return value;
}

std::int64_t ReadInteger(const ConfigTree& tree, std::int64_t low, std::int64_t high) {
  constexpr auto kLowest = std::numeric_limits<std::int64_t>::min();
  constexpr auto kHighest = std::numeric_limits<std::int64_t>::max();
  std::string expected = "an integer";
  if (low != kLowest && high != kHighest) {
    expected += " in [" + std::to_string(low) + ", " + std::to_string(high) + ']';
  } else if (low != kLowest) {
    expected += " >= " + std::to_string(low);
  } else if (high != kHighest) {
    expected += " <= " + std::to_string(high);
  }
  const std::string_view text = DecimalText(tree, expected);
  if (!Scan(text).is_integer) Node(&tree).Fail(Quoted(tree.text) + " is not an integer", expected);
  std::int64_t value = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc() || value < low || value > high) {
    Node(&tree).Fail(Quoted(tree.text) + " is out of range", expected);
  }
  return value;
}

}  // namespace alidade::internal
