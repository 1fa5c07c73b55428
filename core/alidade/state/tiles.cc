// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/tiles.h"

#include <algorithm>

#include "alidade/state/vector_kernels.h"

namespace alidade::internal {
namespace {

/// Calls visit(first, size) for each tile of [0, size).
template <class Visitor>
void ForEachTile(Eigen::Index size, const Visitor& visit) {
  for (Eigen::Index first = 0; first < size; first += kTile) {
    visit(first, std::min(kTile, size - first));
  }
}

Strided ByColumns(const ConstMatrix& a) { return {a.data(), 1, a.outerStride()}; }
Strided Transposed(const ConstMatrix& a) { return {a.data(), a.outerStride(), 1}; }

/// Computes C <- C + sign A B. A has `depth` columns.
void Add(MutableMatrix& c, Eigen::Index depth, const Strided& a, const Strided& b, double sign,
         bool lower_only = false) {
  BestVectorKernels().add_product(c.rows(), c.cols(), depth, a, b, c.data(), c.outerStride(), sign,
                                  lower_only);
}

}  // namespace

void AddProduct(MutableMatrix c, const ConstMatrix& a, const ConstMatrix& b, double sign) {
  Add(c, a.cols(), ByColumns(a), ByColumns(b), sign);
}

void AddProductWithTransposed(MutableMatrix c, const ConstMatrix& a, const ConstMatrix& b,
                              double sign) {
  Add(c, a.cols(), ByColumns(a), Transposed(b), sign);
}

void AddOuterProduct(MutableMatrix c, const ConstMatrix& a, double sign) {
  Add(c, a.cols(), ByColumns(a), Transposed(a), sign, true);
}

void AddSymmetricProduct(MutableMatrix c, const ConstMatrix& a, const ConstMatrix& b, double sign) {
  Add(c, a.cols(), ByColumns(a), Transposed(b), sign, true);
}

void AddOuterProduct(MutableMatrix c, std::span<const int> rows, const ConstMatrix& a) {
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      const int row = rows[static_cast<std::size_t>(i)], column = rows[static_cast<std::size_t>(j)];
      c(std::max(row, column), std::min(row, column)) += a.row(i).dot(a.row(j));
    }
  }
}

void DivideByTransposed(const ConstMatrix& l, MutableMatrix b) {
  BestVectorKernels().divide_by_transposed(b.rows(), l.rows(), l.data(), l.outerStride(), b.data(),
                                           b.outerStride());
}

void Divide(const ConstMatrix& l, MutableMatrix b) {
  ForEachTile(l.rows(), [&](Eigen::Index remaining, Eigen::Index columns) {
    const Eigen::Index j = l.rows() - remaining - columns;
    AddProduct(b.middleCols(j, columns), b.rightCols(remaining),
               l.block(j + columns, j, remaining, columns), -1.0);
    ForEachTile(b.rows(), [&](Eigen::Index i, Eigen::Index rows) {
      auto tile = b.block(i, j, rows, columns);
      l.block(j, j, columns, columns)
          .triangularView<Eigen::Lower>()
          .solveInPlace<Eigen::OnTheRight>(tile);
    });
  });
}

bool Joseph(MutableMatrix p, const ConstMatrix& k, const ConstMatrix& h, const ConstMatrix& r,
            Workspace& work) {
  const Workspace::Use use(work);
  const Eigen::Index n = p.rows(), m = h.rows();
  Workspace::Matrix a = work.Take(n, n), hp = work.Take(m, n), change = work.Take(n, m);
  a = p.selfadjointView<Eigen::Lower>();
  hp.setZero();
  AddProduct(hp, h, a);
  AddProduct(a, k, hp, -1.0);  // (I - K H) P
  change.setZero();
  AddProduct(change, k, r);
  AddProductWithTransposed(change, a, h, -1.0);
  AddProductWithTransposed(a, change, k);
  if (!(a.diagonal().array() >= 0.0).all()) return false;
  p.triangularView<Eigen::Lower>() = a;
  return true;
}

bool Factorise(MutableMatrix s) {
  return BestVectorKernels().factorise(s.rows(), s.data(), s.outerStride());
}

}  // namespace alidade::internal
