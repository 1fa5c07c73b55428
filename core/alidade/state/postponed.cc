// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/postponed.h"

#include <algorithm>
#include <limits>

#include "alidade/state/tiles.h"

namespace alidade {
namespace {

double At(const ConstLowerTriangle& p, int i, int j) { return p(std::max(i, j), std::min(i, j)); }

/// L L' = A + d Var, d the least that the rounding of A asks for, in place of the lower triangle of
/// A; `variances` are those that A comes from.
void TakeRoot(internal::MutableMatrix a, const Eigen::VectorXd& variances) {
  constexpr double kMost = 1e-3;
  const Eigen::MatrixXd before = a;
  const Eigen::VectorXd scale = (variances.array() > 0.0).select(variances, 1.0);
  double d = static_cast<double>(a.rows()) * std::numeric_limits<double>::epsilon();
  for (; d < kMost; d *= 100.0) {
    a.diagonal() += d * scale;
    if (internal::Factorise(a)) return;
    a = before;
  }
  a = scale.cwiseSqrt().asDiagonal();
}

}  // namespace

void Postponed::Begin(std::span<const int> rows, Covariance& active) {
  const int k = static_cast<int>(rows.size());
  basis_.assign(rows.begin(), rows.end());
  active.Clear();
  if (k > 0) active.Add(k);
  active.outside().Grow(k);
  active.outside().SetStill(0, k);
  const ConstLowerTriangle whole = std::as_const(p).lower();
  LowerTriangle own = active.lower();
  for (int j = 0; j < k; ++j) {
    for (int i = j; i < k; ++i) {
      own(i, j) = At(whole, rows[static_cast<std::size_t>(i)], rows[static_cast<std::size_t>(j)]);
    }
  }
  psi_.setZero();
  theta_.setZero(k);
  if (psi_.rows() < k) {
    psi_.setZero(2 * k, 2 * k);
    s_.setZero(2 * k, 2 * k);
  }
  auto root = s_.topLeftCorner(k, k);
  root = own.triangularView<Eigen::Lower>();
  TakeRoot(root, own.diagonal());
  for (int j = 0; j < k; ++j)
    active.outside().phi().row(j).tail(k - j) = s_.col(j).segment(j, k - j);
  active.outside().phi().triangularView<Eigen::StrictlyLower>().setZero();
}

void Postponed::Correct(Covariance& active, const Workspace::Matrix& g, const Workspace::Matrix& w,
                        const Workspace::Vector& y) {
  const Eigen::Index k = basis();
  internal::AddOuterProduct(psi_.topLeftCorner(k, k), g, 1.0);
  theta_.noalias() += g * y;
  internal::AddProductWithTransposed(active.outside().phi(), g, w, -1.0);
}

void Postponed::Recall(int row, int size, int at, Covariance& active, double* dx) {
  const Eigen::Index k = basis();
  const ConstLowerTriangle whole = std::as_const(p).lower();
  Eigen::MatrixXd own(size, size), z(k, size), v(k, size);  // Z and Psi Z of these rows
  for (int j = 0; j < size; ++j) {
    for (int i = 0; i < size; ++i) own(i, j) = At(whole, row + i, row + j);
    for (Eigen::Index i = 0; i < k; ++i) {
      z(i, j) = At(whole, basis_[static_cast<std::size_t>(i)], row + j);
    }
  }
  s_.topLeftCorner(k, k).triangularView<Eigen::Lower>().solveInPlace(z);
  v.noalias() = psi_.topLeftCorner(k, k).selfadjointView<Eigen::Lower>() * z;
  for (int i = 0; i < size; ++i) basis_.push_back(row + i);
  theta_.conservativeResizeLike(Eigen::VectorXd::Zero(k + size));
  if (k + size > psi_.rows()) {
    const Eigen::MatrixXd larger = Eigen::MatrixXd::Zero(2 * (k + size), 2 * (k + size));
    psi_.conservativeResizeLike(larger);
    s_.conservativeResizeLike(larger);
  }
  s_.block(k, 0, size, k) = z.transpose();
  auto root = s_.block(k, k, size, size);
  root = (own - z.transpose() * z).triangularView<Eigen::Lower>();
  TakeRoot(root, own.diagonal());
  Eigen::Map<Eigen::VectorXd>(dx, size) = z.transpose() * theta_.head(k);
  own.noalias() -= z.transpose() * v;
  const JacobianPart part{at, size, 0};
  active.SetParts({&part, 1}, own, active.outside().phi().transpose() * z);
  active.outside().Grow(size);
  active.outside().phi().block(0, at, k, size) = z - v;
  active.outside().phi().block(k, at, size, size) = root.triangularView<Eigen::Lower>().transpose();
  active.outside().SetStill(at, size);
}

void Postponed::CatchUp(Covariance& active, std::span<const int> homes_of_rows,
                        std::vector<double>& dx) {
  const Eigen::Index n = p.size(), k = basis();
  Eigen::MatrixXd z(n, k), v = Eigen::MatrixXd::Zero(n, k);  // Z' and Z' Psi
  const ConstLowerTriangle whole = std::as_const(p).lower();
  for (Eigen::Index j = 0; j < k; ++j) {
    const int row = basis_[static_cast<std::size_t>(j)];
    z.col(j).head(row) = whole.row(row).head(row);
    z.col(j).tail(n - row) = whole.col(row).tail(n - row);
  }
  internal::DivideByTransposed(s_.topLeftCorner(k, k), z);
  const Eigen::MatrixXd psi = psi_.topLeftCorner(k, k).selfadjointView<Eigen::Lower>();
  internal::AddProduct(v, z, psi);
  dx.resize(static_cast<std::size_t>(n));
  Eigen::Map<Eigen::VectorXd>(dx.data(), n).noalias() = z * theta_;
  internal::AddSymmetricProduct(p.lower(), z, v, -1.0);
  // Rows of a that are not still: Cov(b, a) = Z' Phi'.
  std::vector<int> rows;
  for (int j = 0; j < active.size(); ++j) {
    if (homes_of_rows[static_cast<std::size_t>(j)] >= 0 && !active.outside().still(j))
      rows.push_back(j);
  }
  const Eigen::MatrixXd phi = active.outside().phi()(Eigen::all, rows);
  v.setZero(n, std::ssize(rows));
  internal::AddProduct(v, z, phi);
  LowerTriangle now = p.lower();
  const ConstLowerTriangle own = std::as_const(active).lower();
  for (std::size_t j = 0; j < rows.size(); ++j) {
    const int home = homes_of_rows[static_cast<std::size_t>(rows[j])];
    const auto column = v.col(static_cast<Eigen::Index>(j));
    now.row(home).head(home) = column.head(home);
    now.col(home).tail(n - home) = column.tail(n - home);
  }
  for (int j = 0; j < active.size(); ++j) {
    const int b = homes_of_rows[static_cast<std::size_t>(j)];
    for (int i = j; i < active.size() && b >= 0; ++i) {
      const int a = homes_of_rows[static_cast<std::size_t>(i)];
      if (a >= 0) now(std::max(a, b), std::min(a, b)) = own(i, j);
    }
  }
}

}  // namespace alidade
