// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cmath>
#include <limits>

#include "alidade/base/number_text.h"
#include "alidade/config/tree.h"
#include "alidade/state/dense_algebra.h"

namespace alidade {
namespace {

using internal::EigenvaluesOf;
using internal::NumberText;
using internal::Quoted;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

bool IsDigit(char c) { return c >= '0' && c <= '9'; }

std::size_t SkipDigits(std::string_view text, std::size_t at) {
  while (at < text.size() && IsDigit(text[at])) ++at;
  return at;
}

/// The digits of a decimal number: [+-] digits [. digits] [e [+-] digits].
struct Decimal {
  bool valid = false;
  bool integer = false;
  bool leading_zero = false;
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
  decimal.valid = end == text.size();
  decimal.integer = whole_end == text.size();
  decimal.leading_zero = whole_end - begin > 1 && text[begin] == '0';
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

/// The text of a plain scalar that is a decimal number as `expected` says, without a leading '+'.
std::string_view DecimalText(const ConfigTree& tree, const std::string& expected) {
  const Node node(&tree);
  if (tree.kind == Node::Kind::kNull) node.Fail("no value", expected);
  if (tree.kind == Node::Kind::kList) node.Fail("a list", expected);
  if (tree.kind == Node::Kind::kMap) node.Fail("a map", expected);
  const std::string_view text = tree.text;
  if (tree.quoted) node.Fail("the quoted text " + Quoted(text), expected);
  const Decimal decimal = Scan(text);
  if (!decimal.valid) node.Fail(Quoted(text) + " is not a finite number", expected);
  if (decimal.leading_zero) node.Fail(Quoted(text) + " has a leading zero", expected);
  return text[0] == '+' ? text.substr(1) : text;
}

double ReadNumber(const ConfigTree& tree, const std::string& expected) {
  const std::string_view text = DecimalText(tree, expected);
  double value = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc()) {
    Node(&tree).Fail(Quoted(tree.text) + " is too large or too small for a number", expected);
  }
  return value;
}

std::string Shape(std::size_t count) {
  return count == 1 ? "1 item" : std::to_string(count) + " items";
}

/// Each entry divided by the standard deviations of its row and column (1 where that is zero), so
/// that tolerances do not depend on units.
Eigen::MatrixXd Correlation(const Eigen::MatrixXd& covariance) {
  const Eigen::VectorXd sigma = covariance.diagonal().unaryExpr(
      [](double variance) { return variance > 0 ? std::sqrt(variance) : 1.0; });
  const Eigen::VectorXd scale = sigma.cwiseInverse();
  return scale.asDiagonal() * covariance * scale.asDiagonal();
}

void CheckSymmetric(const Node& node, const Eigen::MatrixXd& covariance) {
  constexpr double kTolerance = 1e-9;
  const Eigen::MatrixXd scaled = Correlation(covariance);
  for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      if (!(std::abs(scaled(i, j) - scaled(j, i)) > kTolerance)) continue;
      const auto entry = [&](Eigen::Index row, Eigen::Index column) {
        return '[' + std::to_string(row) + "][" + std::to_string(column) + "] is " +
               NumberText(covariance(row, column));
      };
      node.Fail("not symmetric: " + entry(j, i) + ", " + entry(i, j), "a covariance");
    }
  }
}

void CheckPositive(const Node& node, const Eigen::MatrixXd& covariance) {
  const Eigen::Index size = covariance.rows();
  const double tolerance = 1e-12 * static_cast<double>(size);
  bool positive = EigenvaluesOf(Correlation(covariance))[0] >= -tolerance;
  for (Eigen::Index i = 0; i < size; ++i) {
    const double variance = covariance(i, i);
    if (variance < 0 || (variance == 0 && !covariance.row(i).isZero(0))) positive = false;
  }
  if (positive) return;
  double smallest = EigenvaluesOf(covariance)[0];
  const bool drowned = smallest >= 0;  // in the rounding of a much larger one
  if (drowned) smallest = EigenvaluesOf(Correlation(covariance))[0];
  node.Fail(std::string("not positive semi-definite: ") + (drowned ? "its correlation's" : "its") +
                " smallest eigenvalue is " + internal::RoundedText(smallest, 6),
            "a covariance");
}

}  // namespace

double Node::Number() const { return ReadNumber(*tree_, "a number"); }

double Node::Number(double low, double high, bool low_open, bool high_open) const {
  const std::string expected = Interval("a number", low, high, low_open, high_open);
  const double value = ReadNumber(*tree_, expected);
  if (value < low || value > high || (low_open && value == low) || (high_open && value == high)) {
    Fail(Quoted(tree_->text) + " is out of range", expected);
  }
  return value;
}

std::int64_t Node::Integer(std::int64_t low, std::int64_t high) const {
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
  const std::string_view text = DecimalText(*tree_, expected);
  if (!Scan(text).integer) Fail(Quoted(tree_->text) + " is not an integer", expected);
  std::int64_t value = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc() || value < low || value > high) {
    Fail(Quoted(tree_->text) + " is out of range", expected);
  }
  return value;
}

std::vector<double> Node::Numbers(int size) const {
  std::vector<double> numbers;
  if (kind() != Kind::kList) {
    const std::string expected = size < 0 || size == 1
                                     ? "a number or a list of numbers"
                                     : "a list of " + std::to_string(size) + " numbers";
    numbers.push_back(ReadNumber(*tree_, expected));
  } else {
    for (const Node& item : Items()) numbers.push_back(item.Number());
  }
  if (size < 0 && numbers.empty()) Fail("an empty list", "at least one number");
  if (size >= 0 && numbers.size() != static_cast<std::size_t>(size)) {
    Fail("has " + Shape(numbers.size()), std::to_string(size));
  }
  return numbers;
}

std::vector<double> Node::Covariance(int size) const {
  const std::string expected = std::to_string(size) + " rows of " + std::to_string(size);
  if (kind() != Kind::kList) Fail("not a list of rows", expected);
  const std::vector<Node> rows = Items();
  if (rows.size() != static_cast<std::size_t>(size)) Fail("has " + Shape(rows.size()), expected);
  Eigen::MatrixXd matrix(size, size);
  for (int i = 0; i < size; ++i) {
    const Node& row = rows[static_cast<std::size_t>(i)];
    if (row.kind() != Kind::kList) row.Fail("not a row of numbers", expected);
    const std::vector<double> numbers = row.Numbers(size);
    matrix.row(i) = Eigen::Map<const Eigen::RowVectorXd>(numbers.data(), size);
  }
  if (size == 0) return {};
  CheckSymmetric(*this, matrix);
  matrix = (0.5 * (matrix + matrix.transpose())).eval();
  CheckPositive(*this, matrix);
  return {matrix.data(), matrix.data() + matrix.size()};
}

}  // namespace alidade
