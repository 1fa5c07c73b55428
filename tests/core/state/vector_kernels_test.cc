// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/vector_kernels.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <limits>
#include <utility>
#include <vector>

#include "alidade/base/random.h"
#include "alidade/state/tiles.h"

namespace alidade::internal {
namespace {

using Eigen::MatrixXd;

MatrixXd Drawn(Eigen::Index rows, Eigen::Index columns, Random& random) {
  MatrixXd m(rows, columns);
  for (double& element : m.reshaped()) element = random.Normal();
  return m;
}

/// The largest difference of two matrices, relative to the largest number of the second.
double Difference(const MatrixXd& a, const MatrixXd& b) {
  if (b.size() == 0) return 0.0;
  return (a - b).cwiseAbs().maxCoeff() / (1.0 + b.cwiseAbs().maxCoeff());
}

/// Sizes below, at and above those that the loops take at once.
constexpr Eigen::Index kRowCounts[] = {0, 1, 2, 3, 7, 8, 23, 24, 25, 49, 193, 300};

TEST(VectorKernels, ProductsAreThoseOfEigen) {
  ASSERT_EQ(std::string_view(AllVectorKernels().front().name), "baseline");
  Random random(1);
  for (const VectorKernels& kernels : AllVectorKernels()) {
    for (const Eigen::Index rows : kRowCounts) {
      for (const Eigen::Index depth : {0, 1, 5, 40, 300}) {
        const Eigen::Index columns = rows / 2 + 3;
        const MatrixXd a = Drawn(rows, depth, random), b = Drawn(depth, columns, random);
        const MatrixXd bt = b.transpose(), before = Drawn(rows + 5, columns, random);
        const MatrixXd expected = before.topRows(rows) - a * b;
        MatrixXd c = before, ct = before;
        kernels.add_product(rows, columns, depth, {a.data(), 1, rows}, {b.data(), 1, depth},
                            c.data(), c.outerStride(), -1.0, false);
        kernels.add_product(rows, columns, depth, {a.data(), 1, rows}, {bt.data(), columns, 1},
                            ct.data(), ct.outerStride(), -1.0, false);
        EXPECT_LE(Difference(c.topRows(rows), expected), 1e-12) << kernels.name << rows;
        EXPECT_LE(Difference(ct.topRows(rows), expected), 1e-12) << kernels.name << rows;
        EXPECT_EQ(c.bottomRows(5), before.bottomRows(5)) << kernels.name << rows;
      }
    }
  }
}

TEST(VectorKernels, LowerTriangleLeavesWhatIsAboveIt) {
  Random random(2);
  for (const VectorKernels& kernels : AllVectorKernels()) {
    for (const Eigen::Index n : {1, 5, 24, 31, 200, 800}) {
      const MatrixXd a = Drawn(n, 7, random), before = Drawn(n, n, random);
      const MatrixXd whole = before + a * a.transpose();
      MatrixXd c = before, expected = before;
      expected.triangularView<Eigen::Lower>() = whole;
      kernels.add_product(n, n, 7, {a.data(), 1, n}, {a.data(), n, 1}, c.data(), n, 1.0, true);
      EXPECT_LE(Difference(c, expected), 1e-12) << kernels.name << n;
      const MatrixXd above = c.triangularView<Eigen::StrictlyUpper>();
      EXPECT_EQ(above, MatrixXd(before.triangularView<Eigen::StrictlyUpper>())) << kernels.name;
    }
  }
}

TEST(VectorKernels, DividesAsEigen) {
  Random random(3);
  for (const VectorKernels& kernels : AllVectorKernels()) {
    for (const Eigen::Index rows : kRowCounts) {
      for (const Eigen::Index m : {0, 1, 4, 9, 64, 300}) {
        MatrixXd l = 0.1 * Drawn(m, m, random);  // what is above the diagonal is not read
        l.diagonal().array() += 2.0;
        const MatrixXd before = Drawn(rows + 3, m, random);
        MatrixXd b = before;
        kernels.divide_by_transposed(rows, m, l.data(), l.outerStride(), b.data(), b.outerStride());
        const MatrixXd product =
            b.topRows(rows) * MatrixXd(l.triangularView<Eigen::Lower>()).transpose();
        EXPECT_LE(Difference(product, before.topRows(rows)), 1e-12) << kernels.name << rows << m;
        EXPECT_EQ(b.bottomRows(3), before.bottomRows(3)) << kernels.name << rows;
      }
    }
  }
}

/// `m` in panels, with what is not a number below its last row.
std::vector<double> InPanels(const MatrixXd& m, long height) {
  Panels panels{nullptr, m.rows(), m.cols(), height};
  std::vector<double> data(static_cast<std::size_t>(panels.size()),
                           std::numeric_limits<double>::quiet_NaN());
  panels.data = data.data();
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    for (Eigen::Index j = 0; j < m.cols(); ++j) panels(i, j) = m(i, j);
  }
  return data;
}

TEST(VectorKernels, PanelsAreDividedAsMatricesAre) {
  Random random(5);
  for (const VectorKernels& kernels : AllVectorKernels()) {
    for (const Eigen::Index rows : kRowCounts) {
      for (const Eigen::Index m : {0, 1, 4, 9, 64, 300, 600}) {
        MatrixXd l = 0.1 * Drawn(m, m, random);
        l.diagonal().array() += 2.0;
        const MatrixXd before = Drawn(rows, m, random);
        std::vector<double> data = InPanels(before, kernels.panel_rows);
        kernels.divide_panels(rows, m, l.data(), l.outerStride(), data.data());
        const Panels panels{data.data(), rows, m, kernels.panel_rows};
        MatrixXd b(rows, m);
        Copy(panels, b);
        const MatrixXd product = b * MatrixXd(l.triangularView<Eigen::Lower>()).transpose();
        EXPECT_LE(Difference(product, before), 1e-12) << kernels.name << rows << ' ' << m;
      }
    }
  }
}

TEST(VectorKernels, OuterProductOfPanelsLeavesWhatIsAboveItAndBesideIt) {
  Random random(6);
  for (const VectorKernels& kernels : AllVectorKernels()) {
    for (const Eigen::Index n : {0, 1, 5, 8, 11, 24, 31, 47, 200, 413}) {
      for (const Eigen::Index m : {0, 1, 7, 300}) {
        const MatrixXd w = Drawn(n, m, random), before = Drawn(n + 3, n + 1, random);
        MatrixXd c = before, expected = before;
        expected.topLeftCorner(n, n).triangularView<Eigen::Lower>() -= MatrixXd(w * w.transpose());
        const std::vector<double> data = InPanels(w, kernels.panel_rows);
        kernels.subtract_outer_product(n, m, data.data(), c.data(), c.outerStride());
        EXPECT_LE(Difference(c, expected), 1e-12) << kernels.name << n << ' ' << m;
        expected.topLeftCorner(n, n).triangularView<Eigen::Lower>().setZero();
        c.topLeftCorner(n, n).triangularView<Eigen::Lower>().setZero();
        EXPECT_EQ(c, expected) << kernels.name << n << ' ' << m;
      }
    }
  }
}

/// Rows of H with parts of their own, parts that several have, and one that a row has twice.
struct SparseRows {
  static constexpr int kRows = 57;  ///< of more than one panel of any kernels

  SparseRows(int n, Random& random) {
    const auto part = [n](int offset, int size, int column) {
      return JacobianPart{std::min(offset, n - 1), std::min(size, n - std::min(offset, n - 1)),
                          column};
    };
    parts = {{},
             {part(0, 7, 0), part(20, 3, 7)},
             {part(0, 7, 0), part(23, 6, 7)},
             {part(2, 1, 0), part(40, 30, 1), part(2, 1, 31)},
             {part(n - 1, 1, 0)}};
    counts = {2, 2, 3, 1, kRows - 8};
    for (const int count : counts) data.emplace_back(Drawn(40, count, random));
    for (std::size_t i = 0; i < parts.size(); ++i) {
      rows.push_back({data[i].data(), counts[i], 40, parts[i]});
    }
    dense = MatrixXd::Zero(kRows, n);
    for (Eigen::Index i = 0, at = 0; i < 5; at += counts[static_cast<std::size_t>(i)], ++i) {
      const auto k = static_cast<std::size_t>(i);
      for (const JacobianPart& one : parts[k]) {
        dense.block(at, one.offset, counts[k], one.size) +=
            data[k].middleRows(one.column, one.size).transpose();
      }
    }
  }

  std::vector<std::vector<JacobianPart>> parts;
  std::vector<int> counts;
  std::vector<MatrixXd> data;  ///< each transposed
  std::vector<JacobianRows> rows;
  MatrixXd dense;
};

TEST(VectorKernels, ProjectsAsTheDenseProduct) {
  Random random(8);
  for (const VectorKernels& kernels : AllVectorKernels()) {
    for (const int n : {1, 2, 7, 8, 23, 24, 25, 26, 31, 48, 55, 100, 193}) {
      const SparseRows h(n, random);
      constexpr int m = SparseRows::kRows;
      MatrixXd p = Drawn(n, n, random), s = Drawn(m, m, random);
      p.triangularView<Eigen::StrictlyUpper>().fill(std::numeric_limits<double>::quiet_NaN());
      const MatrixXd whole = p.selfadjointView<Eigen::Lower>(),
                     expected = whole * h.dense.transpose();
      std::vector<double> data = InPanels(MatrixXd::Zero(n, m), kernels.panel_rows);
      const Panels pht{data.data(), n, m, kernels.panel_rows};
      kernels.project(p.data(), n, n, h.rows, pht.data, m, kernels.panel_rows);
      MatrixXd copied(n, m), matrix(n, m + 1);
      Copy(pht, copied);
      EXPECT_LE(Difference(copied, expected), 1e-13) << kernels.name << n;
      matrix.col(m).setConstant(7.0);
      kernels.project(p.data(), n, n, h.rows, matrix.data(), 1, n);
      EXPECT_EQ(matrix.leftCols(m), copied) << kernels.name << n;
      EXPECT_TRUE((matrix.col(m).array() == 7.0).all()) << kernels.name << n;

      MatrixXd sum = s;
      sum.triangularView<Eigen::Lower>() += h.dense * expected;
      kernels.add_projected(n, h.rows, pht.data, s.data(), m);
      EXPECT_LE(Difference(s, sum), 1e-13) << kernels.name << n;
    }
  }
}

TEST(VectorKernels, FactorisesAsEigenAndLeavesTheRest) {
  Random random(9);
  for (const VectorKernels& kernels : AllVectorKernels()) {
    for (const Eigen::Index m : {0, 1, 3, 4, 8, 9, 24, 25, 80, 300}) {
      const MatrixXd root = Drawn(m, m, random);
      const MatrixXd s = root * root.transpose() + MatrixXd::Identity(m, m);
      const MatrixXd l = Eigen::LLT<MatrixXd>(s).matrixL();
      MatrixXd found = MatrixXd::Constant(m + 3, m, -1e300), expected = found;
      found.topRows(m).triangularView<Eigen::Lower>() = s;
      expected.topRows(m).triangularView<Eigen::Lower>() = l;
      EXPECT_TRUE(kernels.factorise(m, found.data(), m + 3)) << kernels.name << m;
      EXPECT_LE(Difference(found.topRows(m).triangularView<Eigen::Lower>(), l), 1e-12)
          << kernels.name << m;
      found.topRows(m).triangularView<Eigen::Lower>() = l;
      EXPECT_EQ(found, expected) << kernels.name << m;
    }
  }
}

TEST(VectorKernels, WhatHasNoFactorIsRefused) {
  for (const VectorKernels& kernels : AllVectorKernels()) {
    for (const auto& [i, j] : {std::pair{0, 0}, {30, 30}, {70, 70}, {1, 0}, {30, 2}, {70, 30}}) {
      for (const double wrong :
           {-2.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
            -std::numeric_limits<double>::infinity()}) {
        MatrixXd s = MatrixXd::Identity(71, 71);
        s(i, j) = wrong;
        EXPECT_FALSE(kernels.factorise(71, s.data(), 71)) << kernels.name << i << ' ' << j;
      }
    }
  }
}

TEST(VectorKernels, CombinesFewColumns) {
  Random random(4);
  for (const VectorKernels& kernels : AllVectorKernels()) {
    for (const Eigen::Index rows : kRowCounts) {
      for (const Eigen::Index m : {1, 2, 3, 4, 5, 7}) {
        const MatrixXd x = Drawn(rows, 6, random), jt = Drawn(8, m, random);
        const MatrixXd before = Drawn(rows, m, random);
        MatrixXd y = before;
        kernels.combine(rows, 6, m, x.data(), rows, jt.data(), 8, y.data(), rows);
        EXPECT_LE(Difference(y, before + x * jt.topRows(6)), 1e-12) << kernels.name << rows << m;
      }
    }
  }
}

}  // namespace
}  // namespace alidade::internal
