// SPDX-License-Identifier: Apache-2.0
#include "alidade/config/read_covariance.h"

#include <cmath>
#include <limits>

#include "alidade/base/number_text.h"
#include "alidade/state/dense_algebra.h"

namespace alidade::internal {
namespace {

/// Divides each entry by the standard deviations of its row and column, so that tolerances do not
/// depend on units. A standard deviation of zero counts as 1.
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
      node.Fail("not symmetric: " + entry(j, i) + ", but " + entry(i, j), "a symmetric matrix");
    }
  }
}

void CheckPositive(const Node& node, const Eigen::MatrixXd& covariance) {
  const Eigen::Index size = covariance.rows();
  const double tolerance = 1e-12 * static_cast<double>(size);
  bool is_positive = EigenvaluesOf(Correlation(covariance))[0] >= -tolerance;
  for (Eigen::Index i = 0; i < size; ++i) {
    const double variance = covariance(i, i);
    if (variance < 0 || (variance == 0 && !covariance.row(i).isZero(0))) is_positive = false;
  }
  if (is_positive) return;
  double smallest = EigenvaluesOf(covariance)[0];
  // The rounding error of a much larger eigenvalue may hide a negative eigenvalue.
  const bool is_hidden = smallest >= 0;
  if (is_hidden) smallest = EigenvaluesOf(Correlation(covariance))[0];
  node.Fail(std::string("not positive semi-definite: ") +
                (is_hidden ? "the correlation matrix's" : "its") + " smallest eigenvalue is " +
                RoundedText(smallest, 6),
            "a covariance");
}

/// Returns L of A = L L', n x n row-major. Computes L column by column. If a pivot is zero within
/// rounding errors, sets its column to zero and `is_singular` to true.
std::vector<double> RootOf(const std::vector<double>& a, int size, bool& is_singular) {
  const auto n = static_cast<std::size_t>(size);
  const double rounding = 64.0 * static_cast<double>(n) * std::numeric_limits<double>::epsilon();
  std::vector<double> l(n * n, 0.0);
  for (std::size_t j = 0; j < n; ++j) {
    const auto reduced = [&](std::size_t i) {
      double sum = a[i * n + j];
      for (std::size_t k = 0; k < j; ++k) sum -= l[i * n + k] * l[j * n + k];
      return sum;
    };
    const double pivot = reduced(j);
    if (!(pivot > rounding * a[j * n + j])) {
      is_singular = true;
      continue;
    }
    l[j * n + j] = std::sqrt(pivot);
    for (std::size_t i = j + 1; i < n; ++i) l[i * n + j] = reduced(i) / l[j * n + j];
  }
  return l;
}

}  // namespace

std::vector<double> ReadCovariance(const Node& node, int size) {
  const std::string expected =
      size == 1 ? "a list of one row of one number, as in [[0.01]]"
                : std::to_string(size) + " rows of " + std::to_string(size) + " numbers";
  if (node.kind() != Node::Kind::kList) node.Fail("not a list of rows", expected);
  const std::vector<Node> rows = node.Items();
  if (rows.size() != static_cast<std::size_t>(size)) {
    node.Fail("has " + std::to_string(rows.size()) + (rows.size() == 1 ? " item" : " items"),
              expected);
  }
  Eigen::MatrixXd matrix(size, size);
  for (int i = 0; i < size; ++i) {
    const Node& row = rows[static_cast<std::size_t>(i)];
    if (row.kind() != Node::Kind::kList) row.Fail("not a row of numbers", expected);
    const std::vector<double> numbers = row.Numbers(size);
    matrix.row(i) = Eigen::Map<const Eigen::RowVectorXd>(numbers.data(), size);
  }
  if (size == 0) return {};
  CheckSymmetric(node, matrix);
  matrix = (0.5 * (matrix + matrix.transpose())).eval();
  CheckPositive(node, matrix);
  return {matrix.data(), matrix.data() + matrix.size()};
}

std::vector<double> ReadSqrtCovariance(const Node& node, int size) {
  bool is_singular = false;
  return RootOf(ReadCovariance(node, size), size, is_singular);
}

std::vector<double> ReadSqrtR(const Node& node, int size) {
  bool is_singular = false;
  std::vector<double> root = RootOf(ReadCovariance(node, size), size, is_singular);
  if (is_singular) {
    node.Fail("is singular, so the measurement would have no noise in one direction",
              "a positive definite covariance");
  }
  return root;
}

void ExpectSigma(const Node& node, double sigma) {
  if (sigma < 0.0) node.Fail("a standard deviation is negative", "a value >= 0");
}

std::vector<double> ReadSigmas(const Node& node, int size, const std::string& unit) {
  std::vector<double> sigmas = node.Numbers(-1, unit);
  RepeatTo(size, node, sigmas);
  for (const double sigma : sigmas) ExpectSigma(node, sigma);
  return sigmas;
}

}  // namespace alidade::internal
