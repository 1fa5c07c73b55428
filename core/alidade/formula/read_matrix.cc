// SPDX-License-Identifier: Apache-2.0
#include "alidade/formula/read_matrix.h"

#include <cmath>

#include "alidade/base/number_text.h"
#include "alidade/config/read_covariance.h"

namespace alidade::internal {
namespace {

std::string CountText(std::ptrdiff_t count, const std::string& noun) {
  return std::to_string(count) + ' ' + noun + (count == 1 ? "" : "s");
}

/// Returns the values of the expressions in a row.
std::vector<double> ReadRow(const Node& node, const FormulaKeys& keys) {
  Program program(0);
  Scope scope(program);
  keys.AddTo(scope);
  return ConstantsOf(ParseExpression(node, scope), program, node);
}

}  // namespace

std::vector<double> ConstantsOf(const Value& value, const Program& program, const Node& node) {
  std::vector<double> numbers;
  for (const int element : value.nodes) {
    const auto number = program.ConstantValue(element);
    if (!number) node.Fail("an element has no finite value", "numbers, such as 2 or 30deg");
    numbers.push_back(*number);
  }
  return numbers;
}

Eigen::MatrixXd ReadMatrix(const Node& node, const std::string& name, int rows, int columns,
                           const FormulaKeys& keys) {
  const std::vector<Node> items = node.ItemsOrOne();
  if (columns < 0 && !items.empty()) columns = static_cast<int>(ReadRow(items[0], keys).size());
  const std::string shape = CountText(rows, "row") + " of " + CountText(columns, "number");
  if (std::ssize(items) != rows) {
    node.Fail("the matrix " + name + " has " + CountText(std::ssize(items), "row"), shape);
  }
  Eigen::MatrixXd matrix(rows, columns);
  for (int i = 0; i < rows; ++i) {
    const Node& item = items[static_cast<std::size_t>(i)];
    const std::vector<double> row = ReadRow(item, keys);
    if (std::ssize(row) != columns) {
      item.Fail("a row of the matrix " + name + " has " + CountText(std::ssize(row), "number"),
                shape);
    }
    matrix.row(i) = Eigen::Map<const Eigen::RowVectorXd>(row.data(), columns);
  }
  return matrix;
}

Eigen::VectorXd ReadSigmas(const Node& node, int size, const FormulaKeys& keys) {
  std::vector<double> sigmas = ReadRow(node, keys);
  RepeatTo(size, node, sigmas);
  for (const double sigma : sigmas) ExpectSigma(node, sigma);
  return Eigen::Map<const Eigen::VectorXd>(sigmas.data(), size);
}

void ExpectVectors(const std::vector<Space>& spaces, const Node& node) {
  for (const Space& space : spaces) {
    if (space.geometry.is_vector()) continue;
    node.Fail("'" + space.name + "' has geometry " + ToString(space.geometry),
              "numbers and vectors, or the model formula");
  }
}

std::vector<std::string> RowTexts(const Eigen::MatrixXd& matrix,
                                  const std::vector<std::string>& names) {
  std::vector<std::string> texts;
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    std::string text;
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
      const double factor = matrix(i, j), size = std::abs(factor);
      if (factor == 0.0) continue;
      text += factor < 0.0 ? (text.empty() ? "-" : " - ") : (text.empty() ? "" : " + ");
      if (size != 1.0) text += NumberText(size) + ' ';
      text += names[static_cast<std::size_t>(j)];
    }
    texts.push_back(text.empty() ? "0" : text);
  }
  return texts;
}

}  // namespace alidade::internal
