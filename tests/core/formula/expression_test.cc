// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>

#include "alidade/formula/functions.h"
#include "alidade/formula/parser.h"
#include "support/formula_models.h"

namespace alidade {
namespace {

using testing::FormulaSensorOf;
using testing::Message;
using testing::NamedSpace;
using testing::PredictionOf;
using testing::VectorSpace;

constexpr double kPi = std::numbers::pi;

/// Returns the elements of an expression of p = (3, 4, 12), s = 0.5 and q, a quarter turn about z.
std::vector<double> Evaluate(const std::string& expression) {
  const SharedSensor sensor = FormulaSensorOf(
      "let:\n  five: norm([p.x, p.y])\nz: {a: '" + expression + "'}\nsigma: {a: 1}\n",
      {VectorSpace("p", 3), NamedSpace("s", Geometry::Vector(1)),
       NamedSpace("q", Geometry::UnitQuaternion())});
  return PredictionOf(sensor, {{3, 4, 12}, {0.5}, {std::sqrt(0.5), 0, 0, std::sqrt(0.5)}});
}

void ExpectValue(const std::string& expression, const std::vector<double>& expected) {
  const std::vector<double> value = Evaluate(expression);
  ASSERT_EQ(value.size(), expected.size()) << expression;
  for (std::size_t i = 0; i < value.size(); ++i) {
    EXPECT_NEAR(value[i], expected[i], 1e-14 * (1.0 + std::abs(expected[i]))) << expression;
  }
}

/// Returns the message of an error in an expression of p = (x, y) and the number bias.
std::string ErrorOf(const std::string& expression) {
  return Message([&] {
    FormulaSensorOf("z: {range: " + expression + "}\nsigma: {range: 1}\n",
                    {VectorSpace("p", 2), NamedSpace("bias", Geometry::Vector(1))});
  });
}

TEST(Expression, HasThePrecedenceOfMathematics) {
  ExpectValue("2 + 3 * 4", {14});
  ExpectValue("2 - 3 - 4", {-5});
  ExpectValue("12 / 3 / 2", {2});
  ExpectValue("-p.x^2", {-9});
  ExpectValue("2^3^2", {512});
  ExpectValue("2^-1", {0.5});
  ExpectValue("--p.x", {3});
  ExpectValue("(2 + 3) * -p[1]", {-20});
}

TEST(Expression, KnowsVectorsAndElements) {
  ExpectValue("p", {3, 4, 12});
  ExpectValue("p.y + p[2]", {16});
  ExpectValue("2 * p - [1, 1, p.x]", {5, 7, 21});
  ExpectValue("p / 2", {1.5, 2, 6});
  ExpectValue("[p, s][3]", {0.5});
  ExpectValue("(p - [1, 1, 1] - p)[2] + rotate(q, p).x", {-5});
  ExpectValue("(2 * p).y", {8});
  ExpectValue("five + 1", {6});
  ExpectValue("norm(p)", {13});
  ExpectValue("dot(p, [1, 0, 2])", {27});
  ExpectValue("cross([1, 0, 0], p)", {0, -12, 4});
  ExpectValue("unit([0, 3, 4])", {0, 0.6, 0.8});
}

TEST(Expression, KnowsTheUsualFunctions) {
  ExpectValue("sqrt(16) + exp(0) + log(exp(2)) + abs(-3)", {10});
  ExpectValue("pow(2, 10) + min(p.x, p.y) + max(p.x, p.y)", {1031});
  ExpectValue("sin(s)", {std::sin(0.5)});
  ExpectValue("cos(s)", {std::cos(0.5)});
  ExpectValue("tan(s)", {std::tan(0.5)});
  ExpectValue("asin(s)", {std::asin(0.5)});
  ExpectValue("acos(s)", {std::acos(0.5)});
  ExpectValue("atan(s)", {std::atan(0.5)});
  ExpectValue("atan2(p.y, p.x)", {std::atan2(4, 3)});
  ExpectValue("hypot(p.x, p.y)", {5});
  ExpectValue("[sinc(0), sinc(s), sinc(1e-3 * s)]",
              {1.0, std::sin(0.5) / 0.5, 1.0 - 0.25e-6 / 6.0});
  ExpectValue("wrap(4)", {4 - 2 * kPi});
}

TEST(Expression, KnowsUnitQuaternions) {
  ExpectValue("rotate(q, p)", {-4, 3, 12});
  ExpectValue("rotate_inverse(q, p)", {4, -3, 12});
  ExpectValue("rotate(multiply(q, q), p)", {-3, -4, 12});
  ExpectValue("rotate(conjugate(q), p)", {4, -3, 12});
  ExpectValue("rotation([0, 0, pi / 2])", {std::sqrt(0.5), 0, 0, std::sqrt(0.5)});
  ExpectValue("rotation([0, 0, 0])", {1, 0, 0, 0});
}

TEST(Expression, NumbersHaveUnits) {
  ExpectValue("30deg", {kPi / 6});
  ExpectValue("2.5e2mm + 1km", {1000.25});
  ExpectValue("90deg/s", {kPi / 2});
  ExpectValue("0.2m/s^2 * 3", {0.6000000000000001});
  ExpectValue("2m / s", {4});
  ExpectValue("20ms", {0.02});
}

TEST(Expression, AUnitIsNotAName) {
  const auto error = [](const std::string& constants) {
    return Message([&] {
      FormulaSensorOf("constants: {" + constants + "}\nz: {h: 0.5g * p.x}\nsigma: {h: 1}\n",
                      {VectorSpace("p", 2)});
    });
  };
  // The gram is a unit elsewhere. In a formula, g is an acceleration.
  EXPECT_EQ(error("c: 9.81"),
            "f.yaml:2:11 z.h: 'g' is not a unit; expected a unit such as deg, ms or m/s^2, or an "
            "operator after the number");
  const std::string remedy =
      "' is the name of a quantity; expected an operator after the number, or another name";
  EXPECT_EQ(error("g: 9.81"), "f.yaml:2:11 z.h: 'g" + remedy);
  for (const char* unit : {"m", "m^2", "m/s^2"}) {
    EXPECT_EQ(Message([&] {
                FormulaSensorOf(std::string("z: {a: 3") + unit + "}\nsigma: {a: 1}\n",
                                {NamedSpace("m", Geometry::Vector(1))});
              }),
              "f.yaml:1:9 z.a: 'm" + remedy);
  }
}

TEST(Expression, ErrorsHaveTheColumnInTheFile) {
  //                           z: {range: norm(p - anchr)}
  EXPECT_EQ(ErrorOf("norm(p - anchr)"),
            "f.yaml:1:21 z.range: the name 'anchr' does not exist; expected bias, p, p.x, p.y");
  EXPECT_EQ(
      ErrorOf("norm(px)"),
      "f.yaml:1:17 z.range: the name 'px' does not exist; expected bias, p, p.x, p.y; did you "
      "mean 'p.x'?");
  EXPECT_EQ(ErrorOf("'norm(px)'").substr(0, 11), "f.yaml:1:18");
  EXPECT_EQ(ErrorOf("p.z"), "f.yaml:1:14 z.range: there is no element 'z'; expected x, y");
  EXPECT_EQ(ErrorOf("bias.x"),
            "f.yaml:1:17 z.range: there is no element 'x'; expected no element, because this is a "
            "number");
  EXPECT_EQ(ErrorOf("norm(p"),
            "f.yaml:1:18 z.range: the expression ends too early; expected ')' or ',', or quotes, "
            "because a comma within { } ends the expression");
  EXPECT_EQ(ErrorOf("'norm(p'"),
            "f.yaml:1:19 z.range: the expression ends too early; expected ')' or ','");
  EXPECT_EQ(ErrorOf("p * p"),
            "f.yaml:1:14 z.range: the product of two vectors; expected dot(a, b) or cross(a, b)");
  EXPECT_EQ(ErrorOf("1 / p"),
            "f.yaml:1:14 z.range: a division by a vector; expected a division by a number");
  EXPECT_EQ(ErrorOf("'p[2]'"),
            "f.yaml:1:15 z.range: '2' is not the index of an element; expected 0 to 1");
  EXPECT_EQ(ErrorOf("'cross(p, p)'"),
            "f.yaml:1:13 z.range: an argument has 2 elements; expected two vectors of 3 elements");
  EXPECT_EQ(
      ErrorOf("3parsec"),
      "f.yaml:1:13 z.range: 'parsec' is not a unit; expected a unit such as deg, ms or m/s^2, "
      "or an operator after the number");
  EXPECT_EQ(ErrorOf("'hypot(p.x)'"),
            "f.yaml:1:13 z.range: 'hypot' is called with 1 argument; expected hypot(x, y)");
  EXPECT_EQ(ErrorOf("bias bias"),
            "f.yaml:1:17 z.range: unexpected 'b'; expected an operator, or the end of the "
            "expression");
  const std::string function = ErrorOf("'arctan2(p.y, p.x)'");
  EXPECT_TRUE(function.starts_with("f.yaml:1:13 z.range: the function 'arctan2' does not exist"));
  EXPECT_TRUE(function.ends_with("did you mean 'atan2'?")) << function;
}

TEST(Expression, ErrorsInATextOfSeveralLinesHaveItsLine) {
  const std::string message = Message([] {
    FormulaSensorOf("z:\n  range: |\n    norm(p\n    - anchor)\nsigma: {range: 1}\n",
                    {VectorSpace("p", 2)});
  });
  EXPECT_NE(message.find("in line 2, column 3 of the expression"), std::string::npos) << message;
}

TEST(Expression, ErrorsInAFoldedTextHaveNoColumnInTheFile) {
  const auto error = [](const std::string& expression) {
    return Message([&] {
      FormulaSensorOf("z:\n  a: " + expression + "\nsigma: {a: 1}\n", {VectorSpace("p", 2)});
    });
  };
  const std::string expected =
      " z.a: the name 'q' does not exist, in column 9 of the expression; "
      "expected p, p.x, p.y; did you mean 'p'?";
  EXPECT_EQ(error("(p.x) *\n       q"), "f.yaml:2:6" + expected);
  EXPECT_EQ(error("'(p.x) *\n       q'"), "f.yaml:2:6" + expected);
  EXPECT_EQ(error("\"(p.x) *\n       q\""), "f.yaml:2:6" + expected);
  EXPECT_EQ(error("\"(p.\\x78) * q\""), "f.yaml:2:6" + expected);
  EXPECT_EQ(
      error("(p.x) * q"),
      "f.yaml:2:14 z.a: the name 'q' does not exist; expected p, p.x, p.y; did you mean 'p'?");
}

TEST(Expression, RefusesWhatIsTooLong) {
  EXPECT_NE(ErrorOf("'" + std::string(2000, '(') + "'").find("nested too deep"), std::string::npos);
  EXPECT_NE(ErrorOf("'" + std::string(2000, '-') + "1'").find("nested too deep"),
            std::string::npos);
  std::string sum = "bias";
  for (int i = 0; i < 2000; ++i) sum += " + sin(" + std::to_string(i) + " * bias)";
  EXPECT_NE(ErrorOf("'" + sum + "'").find("the expression is too long"), std::string::npos);
  std::string chain = "z: {a: a0}\nsigma: {a: 1}\nlet:\n";
  for (int i = 0; i < 2000; ++i)
    chain += "  a" + std::to_string(i) + ": a" + std::to_string(i + 1) + "\n";
  EXPECT_NE(Message([&] { FormulaSensorOf(chain, {}); }).find("nested too deep"),
            std::string::npos);
}

TEST(Expression, DefinitionsMayNotDependOnThemselves) {
  EXPECT_EQ(Message([] {
              FormulaSensorOf("let: {a: b, b: 2 * a}\nz: {range: p.x}\nsigma: {range: 1}\n",
                              {VectorSpace("p", 2)});
            }),
            "f.yaml:1:10 let.a: 'a' depends on itself");
  EXPECT_EQ(Message([] {
              FormulaSensorOf("let: {p: 1}\nz: {range: p.x}\nsigma: {range: 1}\n",
                              {VectorSpace("p", 2)});
            }),
            "f.yaml:1:10 let.p: the name 'p' is already used; expected another name");
}

/// Returns the rows of the table of functions in docs/formula.md.
std::string FunctionList() {
  std::string list = "| function | meaning |\n|---|---|\n";
  for (const internal::Function& function : internal::Functions()) {
    list += std::string("| `") + function.call + "` | " + function.meaning + " |\n";
  }
  return list;
}

TEST(Expression, EveryFunctionIsInTheDocumentation) {
  std::ostringstream text;
  text << std::ifstream(std::string(ALIDADE_SOURCE_DIR) + "/docs/formula.md").rdbuf();
  EXPECT_NE(text.str().find(FunctionList()), std::string::npos) << FunctionList();
}

}  // namespace
}  // namespace alidade
