// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "alidade/formula/formula_keys.h"

namespace alidade::internal {

/// Reads a matrix as a list of rows. A row is a list of expressions of constants. A row of one
/// element, and a matrix of one row and one column, may be one expression. `name` is the name of
/// the matrix in messages. If `columns` < 0, the first row determines the number of columns.
Eigen::MatrixXd ReadMatrix(const Node& node, const std::string& name, int rows, int columns,
                           const FormulaKeys& keys);

/// Reads one standard deviation for all elements, or one for each of `size` elements.
Eigen::VectorXd ReadSigmas(const Node& node, int size, const FormulaKeys& keys);

/// Returns the elements of a value that depends on constants only. `node` is its expression.
std::vector<double> ConstantsOf(const Value& value, const Program& program, const Node& node);

/// Rejects spaces that are not vectors. `node` is the place that messages report.
void ExpectVectors(const std::vector<Space>& spaces, const Node& node);

/// Returns for each row of `matrix` the text of its terms, such as `2 p.x - v.x`, or `0`. `names`
/// are the names of the columns.
std::vector<std::string> RowTexts(const Eigen::MatrixXd& matrix,
                                  const std::vector<std::string>& names);

}  // namespace alidade::internal
