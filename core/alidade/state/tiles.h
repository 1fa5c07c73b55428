// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>

/// Products and factors of matrices in tiles that are small enough for Eigen to work on the stack:
/// nothing is allocated at any size.
namespace alidade::internal {

constexpr Eigen::Index kTile = 96;  // a panel of it takes 74 kB; Eigen's limit is 128 kB

/// Calls take(first, size) for the tiles of [0, size).
template <class Take>
void ForEachTile(Eigen::Index size, const Take& take) {
  for (Eigen::Index at = 0; at < size; at += kTile) take(at, std::min(kTile, size - at));
}

/// C <- C + sign A B, A l x k, B k x m, sign 1 or -1. (Of a factor within the product Eigen makes a
/// copy where A has one row.)
template <class A, class B>
void AddProduct(Eigen::Ref<Eigen::MatrixXd> c, const A& a, const B& b, double sign = 1.0) {
  ForEachTile(b.cols(), [&](Eigen::Index j, Eigen::Index columns) {
    ForEachTile(a.cols(), [&](Eigen::Index k, Eigen::Index depth) {
      ForEachTile(a.rows(), [&](Eigen::Index i, Eigen::Index rows) {
        auto tile = c.block(i, j, rows, columns);
        const auto left = a.block(i, k, rows, depth);
        const auto right = b.block(k, j, depth, columns);
        if (sign > 0.0) {
          tile.noalias() += left * right;
        } else {
          tile.noalias() -= left * right;
        }
      });
    });
  });
}

/// The lower triangle of C <- C + sign A A', A n x m, sign 1 or -1.
template <class A>
void AddOuterProduct(Eigen::Ref<Eigen::MatrixXd> c, const A& a, double sign) {
  ForEachTile(a.rows(), [&](Eigen::Index j, Eigen::Index columns) {
    ForEachTile(a.cols(), [&](Eigen::Index k, Eigen::Index depth) {
      const auto right = a.block(j, k, columns, depth);
      c.block(j, j, columns, columns)
          .template selfadjointView<Eigen::Lower>()
          .rankUpdate(right, sign);
    });
    const Eigen::Index below = a.rows() - j - columns;
    AddProduct(c.block(j + columns, j, below, columns), a.bottomRows(below),
               a.middleRows(j, columns).transpose(), sign);
  });
}

/// B <- B L^-T, L the lower triangle of `l`, m x m, B n x m.
template <class L>
void DivideByTransposed(const L& l, Eigen::Ref<Eigen::MatrixXd> b) {
  ForEachTile(l.rows(), [&](Eigen::Index j, Eigen::Index columns) {
    AddProduct(b.middleCols(j, columns), b.leftCols(j), l.block(j, 0, columns, j).transpose(),
               -1.0);
    ForEachTile(b.rows(), [&](Eigen::Index i, Eigen::Index rows) {
      auto tile = b.block(i, j, rows, columns);
      l.block(j, j, columns, columns)
          .template triangularView<Eigen::Lower>()
          .transpose()
          .template solveInPlace<Eigen::OnTheRight>(tile);
    });
  });
}

/// B <- B L^-1, L the lower triangle of `l`, m x m, B n x m.
template <class L>
void Divide(const L& l, Eigen::Ref<Eigen::MatrixXd> b) {
  const Eigen::Index m = l.rows();
  ForEachTile(m, [&](Eigen::Index from_end, Eigen::Index columns) {
    const Eigen::Index j = m - from_end - columns;
    AddProduct(b.middleCols(j, columns), b.rightCols(from_end),
               l.block(j + columns, j, from_end, columns), -1.0);
    ForEachTile(b.rows(), [&](Eigen::Index i, Eigen::Index rows) {
      auto tile = b.block(i, j, rows, columns);
      l.block(j, j, columns, columns)
          .template triangularView<Eigen::Lower>()
          .template solveInPlace<Eigen::OnTheRight>(tile);
    });
  });
}

/// Puts L of a symmetric S = L L' in place of its lower triangle; false unless S is finite and
/// positive definite. (Eigen's own LLT reports success on NaN.)
inline bool Factorise(Eigen::Ref<Eigen::MatrixXd> s) {
  if (!s.allFinite()) return false;
  bool positive = true;
  ForEachTile(s.rows(), [&](Eigen::Index j, Eigen::Index columns) {
    if (!positive) return;
    Eigen::Ref<Eigen::MatrixXd> diagonal = s.block(j, j, columns, columns);
    AddOuterProduct(diagonal, s.block(j, 0, columns, j), -1.0);
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(diagonal);
    positive = llt.info() == Eigen::Success && (diagonal.diagonal().array() > 0.0).all();
    const Eigen::Index below = s.rows() - j - columns;
    auto panel = s.block(j + columns, j, below, columns);
    AddProduct(panel, s.block(j + columns, 0, below, j), s.block(j, 0, columns, j).transpose(),
               -1.0);
    DivideByTransposed(diagonal, panel);
  });
  return positive;
}

}  // namespace alidade::internal
