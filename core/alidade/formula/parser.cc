// SPDX-License-Identifier: Apache-2.0
#include "alidade/formula/parser.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <utility>

#include "alidade/base/text.h"
#include "alidade/config/tree.h"
#include "alidade/config/unit.h"

namespace alidade::internal {
namespace {

constexpr std::size_t kMaxVectorSize = 64;  // of a vector
constexpr int kMaxNesting = 100;            // of nested expressions

bool IsLetter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }

class Parser {
 public:
  Parser(const Node& node, Scope& scope) : node_(node), scope_(scope), text_(node.Text()) {}

  Value Expression() {
    Value value = Sum();
    if (!AtEnd()) FailHere("an operator, or the end of the expression");
    return value;
  }

  std::vector<Condition> Conditions() {
    std::vector<Condition> conditions;
    do {
      Value left = Number();
      if (!IsRelation()) FailHere("a comparison: <, <=, > or >=");
      while (IsRelation()) {
        const bool is_less = text_[offset_++] == '<';
        const bool accepts_zero = Accept('=');
        const Value right = Number();
        const Value& larger = is_less ? right : left;
        const Value& smaller = is_less ? left : right;
        conditions.push_back(
            {Operator(Op::kSubtract, larger, smaller, offset_).nodes[0], accepts_zero});
        left = right;
      }
    } while (AcceptWord(kAnd));
    if (!AtEnd()) FailHere("`and`, or the end of the condition");
    return conditions;
  }

 private:
  /// Fails at a place of the expression. The message contains the column in the file, or that in
  /// the expression if the file contains the text in another form, such as in several lines.
  [[noreturn]] void Fail(std::size_t offset, std::string problem, const std::string& expected = {},
                         const std::string& suggestion = {}) const {
    Place place = node_.place();
    if (node_.tree().is_verbatim) {
      place.column += static_cast<int>(offset) + (node_.tree().quoted ? 1 : 0);
    } else {
      const std::string_view before = std::string_view(text_).substr(0, offset);
      const std::size_t line_begin = before.rfind('\n') + 1;  // npos + 1 is 0
      const bool has_lines = text_.find('\n') != std::string::npos;
      problem += ", in ";
      if (has_lines)
        problem += "line " + std::to_string(1 + std::ranges::count(before, '\n')) + ", ";
      problem += "column " + std::to_string(1 + offset - line_begin) + " of the expression";
    }
    FailAt(place, node_.path(), problem, expected, suggestion);
  }
  [[noreturn]] void FailHere(const std::string& expected) {
    SkipSpace();
    if (offset_ < text_.size())
      Fail(offset_, "unexpected " + Quoted(text_.substr(offset_, 1)), expected);
    const bool is_cut = expected.ends_with("','") && !node_.tree().quoted;
    Fail(offset_, "the expression ends too early",
         expected + (is_cut ? ", or quotes, because a comma within { } ends the expression" : ""));
  }

  void SkipSpace() {
    while (offset_ < text_.size() && (text_[offset_] == ' ' || text_[offset_] == '\n')) ++offset_;
  }
  bool AtEnd() {
    SkipSpace();
    return offset_ == text_.size();
  }
  char Peek() { return AtEnd() ? '\0' : text_[offset_]; }
  bool Accept(char c) {
    if (Peek() != c) return false;
    ++offset_;
    return true;
  }
  void Expect(char c, const char* expected) {
    if (!Accept(c)) FailHere(expected);
  }
  bool IsRelation() { return Peek() == '<' || Peek() == '>'; }
  bool AcceptWord(std::string_view word) {
    SkipSpace();
    const std::size_t begin = offset_;
    if (Name() == word) return true;
    offset_ = begin;
    return false;
  }
  /// Reads letters, digits and `_`.
  std::string Name() {
    const std::size_t begin = offset_;
    while (offset_ < text_.size() && (IsLetter(text_[offset_]) || IsDigit(text_[offset_])))
      ++offset_;
    return text_.substr(begin, offset_ - begin);
  }

  /// Calls `compile`, and reports its errors at `offset`.
  template <class Compile>
  Value Compiled(std::size_t offset, const Compile& compile) const {
    try {
      Value value = compile();
      if (scope_.program().size() <= Program::kMaxNodes && value.size() <= kMaxVectorSize)
        return value;
    } catch (const OperandError& e) {
      Fail(offset, e.what(), e.expected);
    }
    Fail(offset, "the expression is too long",
         "at most " + std::to_string(Program::kMaxNodes) + " operations, and vectors of at most " +
             std::to_string(kMaxVectorSize) + " elements");
  }
  Value Operator(Op op, const Value& a, const Value& b, std::size_t offset) const {
    return Compiled(offset, [&] { return CompileOperator(scope_.program(), op, a, b); });
  }

  Value Number() {
    SkipSpace();
    const std::size_t begin = offset_;
    Value value = Sum();
    if (value.size() != 1) Fail(begin, "a vector", "a number on each side of a comparison");
    return value;
  }
  Value Sum() {
    Value value = Product();
    for (;;) {
      const char c = Peek();
      if (c != '+' && c != '-') return value;
      const std::size_t offset = offset_++;
      value = Operator(c == '+' ? Op::kAdd : Op::kSubtract, value, Product(), offset);
    }
  }
  Value Product() {
    Value value = Unary();
    for (;;) {
      const char c = Peek();
      if (c != '*' && c != '/') return value;
      const std::size_t offset = offset_++;
      value = Operator(c == '*' ? Op::kMultiply : Op::kDivide, value, Unary(), offset);
    }
  }
  Value Unary() {
    if (++depth_ > kMaxNesting) {
      Fail(offset_, "the expression is nested too deep",
           "at most " + std::to_string(kMaxNesting) + " levels");
    }
    Value value;
    if (Accept('+')) {
      value = Unary();
    } else if (Accept('-')) {
      value = CompileNegation(scope_.program(), Unary());
    } else {
      value = Power();
    }
    --depth_;
    return value;
  }
  Value Power() {
    Value value = Postfix();
    if (Peek() != '^') return value;
    const std::size_t offset = offset_++;
    return Operator(Op::kPower, value, Unary(), offset);
  }
  Value Postfix() {
    Value value = Primary();
    for (;;) {
      if (Accept('[')) {
        value = Index(value);
      } else if (offset_ < text_.size() && text_[offset_] == '.') {
        ++offset_;
        value = Element(value);
      } else {
        return value;
      }
    }
  }
  Value Index(const Value& value) {
    SkipSpace();
    const std::size_t begin = offset_;
    while (offset_ < text_.size() && IsDigit(text_[offset_])) ++offset_;
    std::size_t index = 0;
    const auto result = std::from_chars(text_.data() + begin, text_.data() + offset_, index);
    if (result.ec != std::errc() || index >= value.size()) {
      Fail(begin, "'" + text_.substr(begin, offset_ - begin) + "' is not the index of an element",
           value.size() == 1 ? "no index, because this is a number"
                             : "0 to " + std::to_string(value.size() - 1));
    }
    Expect(']', "']' after the index");
    return {{value.nodes[index]}};
  }
  Value Element(const Value& value) {
    const std::size_t begin = offset_;
    const std::string name = Name();
    const auto found = std::ranges::find(value.elements, name);
    if (found != value.elements.end()) {
      return {{value.nodes[static_cast<std::size_t>(found - value.elements.begin())]}};
    }
    Fail(begin, "there is no element '" + name + "'",
         !value.elements.empty() ? Join(value.elements)
         : value.size() > 1      ? "[0] for the first element"
                                 : "no element, because this is a number");
  }
  Value Primary() {
    const char c = Peek();
    const std::size_t begin = offset_;
    if (Accept('(')) {
      Value value = Sum();
      Expect(')', "')'");
      return value;
    }
    if (Accept('[')) return Vector(begin);
    if (IsDigit(c) || c == '.') return Literal();
    if (!IsLetter(c)) FailHere("a number, a name or '('");
    const std::string name = Name();
    if (Accept('(')) return Call(name, begin);
    if (name == kPi) return {{scope_.program().Constant(std::numbers::pi)}};
    return Named(name, begin);
  }
  Value Vector(std::size_t begin) {
    Value value;
    do {
      const Value element = Sum();
      value.nodes.insert(value.nodes.end(), element.nodes.begin(), element.nodes.end());
      Compiled(begin, [&] { return value; });
    } while (Accept(','));
    Expect(']', "']' or ','");
    return value;
  }
  /// Reads a number and the unit that directly follows it, such as `2deg` or `0.3m/s^2`.
  Value Literal() {
    const std::size_t begin = offset_;
    double number = 0.0;
    const auto result = std::from_chars(text_.data() + begin, text_.data() + text_.size(), number);
    if (result.ec != std::errc() || !std::isfinite(number))
      Fail(begin, "this is not a finite number");
    offset_ = static_cast<std::size_t>(result.ptr - text_.data());
    const std::size_t unit_begin = offset_;
    SkipUnit();
    if (offset_ == unit_begin) return {{scope_.program().Constant(number)}};
    const std::string unit_text = text_.substr(unit_begin, offset_ - unit_begin);
    const std::string first_factor = unit_text.substr(0, unit_text.find_first_of("/^"));
    if (scope_.Contains(first_factor)) {
      Fail(unit_begin, Quoted(first_factor) + " is the name of a quantity",
           "an operator after the number, or another name");
    }
    const auto unit = ParseUnit(unit_text);
    if (!unit || unit->si.find("kg") != std::string::npos) {  // g is not the gram
      Fail(unit_begin, Quoted(unit_text) + " is not a unit",
           "a unit such as deg, ms or m/s^2, or an operator after the number");
    }
    return {{scope_.program().Constant(number * unit->factor)}};
  }
  void SkipUnit() {
    for (;;) {
      const std::size_t begin = offset_;
      while (offset_ < text_.size() && (IsLetter(text_[offset_]) || text_[offset_] == '%'))
        ++offset_;
      if (offset_ == begin) return;
      const bool is_square =
          text_.compare(offset_, 2, "^2") == 0 && !IsDigit(text_.c_str()[offset_ + 2]);
      if (is_square) offset_ += 2;
      const char* const next = text_.c_str() + offset_;
      if (next[0] != '/' || !IsLetter(next[1])) return;
      ++offset_;
    }
  }
  Value Named(const std::string& name, std::size_t begin) {
    const Symbol* const symbol = scope_.Find(name);
    if (symbol == nullptr) {
      const std::vector<std::string> names = scope_.Names();
      const std::vector<std::string> elements_first(names.rbegin(), names.rend());
      Fail(begin, "the name '" + name + "' does not exist", Join(names),
           Nearest(name, elements_first));
    }
    const std::size_t end = offset_;
    if (!symbol->parts.empty() && end < text_.size() && text_[end] == '.') {
      ++offset_;
      const std::string part_name = Name();
      for (const auto& [part, value] : symbol->parts) {
        if (part == part_name) return value;
      }
      offset_ = end;
    }
    return symbol->value;
  }
  Value Call(const std::string& name, std::size_t begin) {
    std::vector<Value> arguments;
    if (!Accept(')')) {
      do {
        arguments.push_back(Sum());
      } while (Accept(','));
      Expect(')', "')' or ','");
    }
    std::vector<std::string> names;
    for (const Function& function : Functions()) {
      names.emplace_back(function.name);
      if (name != function.name) continue;
      if (arguments.size() != function.arguments) {
        Fail(begin,
             "'" + name + "' is called with " + std::to_string(arguments.size()) +
                 (arguments.size() == 1 ? " argument" : " arguments"),
             function.call);
      }
      return Compiled(begin, [&] { return function.compile(scope_.program(), arguments); });
    }
    Fail(begin, "the function '" + name + "' does not exist", Join(names), Nearest(name, names));
  }

  const Node& node_;
  Scope& scope_;
  std::string text_;
  std::size_t offset_ = 0;
  int depth_ = 0;
};

}  // namespace

bool IsIdentifier(std::string_view name) {
  return !name.empty() && IsLetter(name[0]) &&
         std::ranges::all_of(name, [](char c) { return IsLetter(c) || IsDigit(c); });
}

Value ParseExpression(const Node& node, Scope& scope) {
  if (node.kind() != Node::Kind::kList) return Parser(node, scope).Expression();
  Value value;
  for (const Node& item : node.Items()) {
    const Value element = Parser(item, scope).Expression();
    value.nodes.insert(value.nodes.end(), element.nodes.begin(), element.nodes.end());
  }
  if (value.nodes.empty() || value.size() > kMaxVectorSize) {
    node.Fail("a vector of " + std::to_string(value.size()) + " elements",
              "1 to " + std::to_string(kMaxVectorSize) + " elements");
  }
  return value;
}

Value ParseExpression(const Node& node, Scope& scope, int size, const std::string& subject) {
  Value value = ParseExpression(node, scope);
  if (std::ssize(value.nodes) != size) {
    node.Fail("the expression has " + std::to_string(value.size()) +
                  (value.size() == 1 ? " element" : " elements"),
              std::to_string(size) + ", as " + subject);
  }
  return value;
}

std::vector<Condition> ParseConditions(const Node& node, Scope& scope) {
  std::vector<Condition> conditions;
  for (const Node& item : node.ItemsOrOne()) {
    for (const Condition& condition : Parser(item, scope).Conditions())
      conditions.push_back(condition);
  }
  return conditions;
}

}  // namespace alidade::internal
