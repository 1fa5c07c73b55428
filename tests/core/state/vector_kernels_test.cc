// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/vector_kernels.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <limits>
#include <utility>

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

/// Returns the largest difference of two matrices, divided by 1 plus the largest element of `b`.
double Difference(const MatrixXd& a, const MatrixXd& b) {
  if (b.size() == 0) return 0.0;
  return (a - b).cwiseAbs().maxCoeff() / (1.0 + b.cwiseAbs().maxCoeff());
}

/// Row counts below, at and above the number of rows that one loop iteration processes.
constexpr Eigen::Index kRowCounts[] = {0, 1, 2, 3, 7, 8, 23, 24, 25, 49, 193, 300};

TEST(VectorKernels, ProductsAreThoseOfEigen) {
  Random random(1);
  for (const InstructionSet set : AllInstructionSets()) {
    const VectorKernels& kernels = VectorKernelsOf(set);
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
        EXPECT_LE(Difference(c.topRows(rows), expected), 1e-12) << ToString(set) << rows;
        EXPECT_LE(Difference(ct.topRows(rows), expected), 1e-12) << ToString(set) << rows;
        EXPECT_EQ(c.bottomRows(5), before.bottomRows(5)) << ToString(set) << rows;
      }
    }
  }
}

TEST(VectorKernels, LowerTriangleLeavesWhatIsAboveIt) {
  Random random(2);
  for (const InstructionSet set : AllInstructionSets()) {
    const VectorKernels& kernels = VectorKernelsOf(set);
    for (const Eigen::Index n : {1, 5, 24, 31, 200, 800}) {
      const MatrixXd a = Drawn(n, 7, random), before = Drawn(n, n, random);
      const MatrixXd whole = before + a * a.transpose();
      MatrixXd c = before, expected = before;
      expected.triangularView<Eigen::Lower>() = whole;
      kernels.add_product(n, n, 7, {a.data(), 1, n}, {a.data(), n, 1}, c.data(), n, 1.0, true);
      EXPECT_LE(Difference(c, expected), 1e-12) << ToString(set) << n;
      const MatrixXd above = c.triangularView<Eigen::StrictlyUpper>();
      EXPECT_EQ(above, MatrixXd(before.triangularView<Eigen::StrictlyUpper>())) << ToString(set);
    }
  }
}

TEST(VectorKernels, DividesAsEigen) {
  Random random(3);
  for (const InstructionSet set : AllInstructionSets()) {
    const VectorKernels& kernels = VectorKernelsOf(set);
    for (const Eigen::Index rows : kRowCounts) {
      for (const Eigen::Index m : {0, 1, 4, 9, 64, 300}) {
        MatrixXd l = 0.1 * Drawn(m, m, random);  // the upper triangle is not read
        l.diagonal().array() += 2.0;
        const MatrixXd before = Drawn(rows + 3, m, random);
        MatrixXd b = before;
        kernels.divide_by_transposed(rows, m, l.data(), l.outerStride(), b.data(), b.outerStride());
        const MatrixXd product =
            b.topRows(rows) * MatrixXd(l.triangularView<Eigen::Lower>()).transpose();
        EXPECT_LE(Difference(product, before.topRows(rows)), 1e-12) << ToString(set) << rows << m;
        EXPECT_EQ(b.bottomRows(3), before.bottomRows(3)) << ToString(set) << rows;
      }
    }
  }
}

TEST(VectorKernels, FactorisesAsEigenAndLeavesTheRest) {
  Random random(9);
  for (const InstructionSet set : AllInstructionSets()) {
    const VectorKernels& kernels = VectorKernelsOf(set);
    for (const Eigen::Index m : {0, 1, 3, 4, 8, 9, 24, 25, 80, 300}) {
      const MatrixXd root = Drawn(m, m, random);
      const MatrixXd s = root * root.transpose() + MatrixXd::Identity(m, m);
      const MatrixXd l = Eigen::LLT<MatrixXd>(s).matrixL();
      MatrixXd found = MatrixXd::Constant(m + 3, m, -1e300), expected = found;
      found.topRows(m).triangularView<Eigen::Lower>() = s;
      expected.topRows(m).triangularView<Eigen::Lower>() = l;
      EXPECT_TRUE(kernels.factorise(m, found.data(), m + 3)) << ToString(set) << m;
      EXPECT_LE(Difference(found.topRows(m).triangularView<Eigen::Lower>(), l), 1e-12)
          << ToString(set) << m;
      found.topRows(m).triangularView<Eigen::Lower>() = l;
      EXPECT_EQ(found, expected) << ToString(set) << m;
    }
  }
}

TEST(VectorKernels, WhatHasNoFactorIsRefused) {
  for (const InstructionSet set : AllInstructionSets()) {
    const VectorKernels& kernels = VectorKernelsOf(set);
    for (const auto& [i, j] : {std::pair{0, 0}, {30, 30}, {70, 70}, {1, 0}, {30, 2}, {70, 30}}) {
      for (const double wrong :
           {-2.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
            -std::numeric_limits<double>::infinity()}) {
        MatrixXd s = MatrixXd::Identity(71, 71);
        s(i, j) = wrong;
        EXPECT_FALSE(kernels.factorise(71, s.data(), 71)) << ToString(set) << i << ' ' << j;
      }
    }
  }
}

}  // namespace
}  // namespace alidade::internal
