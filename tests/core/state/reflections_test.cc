// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/reflections.h"

#include <gtest/gtest.h>

#include <Eigen/Core>

#include "alidade/base/random.h"
#include "alidade/state/vector_kernels.h"

namespace alidade::internal {
namespace {

using Eigen::MatrixXd;

/// Returns a matrix in padded memory with normally distributed elements.
Workspace::Matrix DrawnPadded(Eigen::Index rows, Eigen::Index columns, Random& random,
                              Workspace& work) {
  Workspace::Matrix a = TakePadded(work, rows, columns);
  for (double& element : a.topRows(rows).reshaped()) element = random.Normal();
  return a;
}

TEST(Reflections, EveryInstructionSetComputesTheProductWithTheReflection) {
  Random random(1);
  for (const InstructionSet set : AllInstructionSets()) {
    for (const Eigen::Index rows : {1, 8, 9, 24}) {
      for (const Eigen::Index columns : {1, 2, 7}) {
        Workspace work;
        Workspace::Matrix a = DrawnPadded(rows, columns, random, work);
        Eigen::VectorXd v(columns);
        for (double& element : v) element = random.Normal();
        const MatrixXd expected = a - a * v * v.transpose();
        VectorKernelsOf(set).reflect(a.rows(), columns - 1, v.data(), a.data(), a.data() + a.rows(),
                                     a.rows());
        EXPECT_LT((a - expected).norm(), 1e-13 * expected.norm()) << ToString(set) << rows;
      }
    }
  }
}

// The reflections, in reverse order, lead from [L 0] back to A.
TEST(Reflections, TriangulariseARootOfTheSameMatrix) {
  Random random(2);
  for (const Eigen::Index n : {1, 3, 12}) {
    for (const Eigen::Index columns : {n, n + 1, 2 * n + 3}) {
      Workspace work;
      Workspace::Matrix a = DrawnPadded(n, columns, random, work), v = work.Take(columns, n);
      a.row(n / 2) *= 1e9;  // a vague state
      const MatrixXd before = a.topRows(n);
      Triangularise(a, v);
      const MatrixXd l = a.topLeftCorner(n, n);
      EXPECT_EQ(l, MatrixXd(l.triangularView<Eigen::Lower>()));
      EXPECT_EQ(a.rightCols(columns - n).norm(), 0.0);
      for (Eigen::Index k = n - 1; k >= 0; --k) Reflect(a, a.col(k).data(), k + 1, &v(k, k));
      for (Eigen::Index i = 0; i < n; ++i) {
        EXPECT_LT((a.row(i) - before.row(i)).norm(), 1e-14 * before.row(i).norm()) << n << i;
      }
    }
  }
}

TEST(Reflections, ARowOfZerosStaysZero) {
  Workspace work;
  Workspace::Matrix a = TakePadded(work, 2, 3), v = work.Take(3, 2);
  a.row(1) << 3.0, 0.0, 4.0;
  Triangularise(a, v);
  EXPECT_EQ(a.row(0).norm(), 0.0);
  EXPECT_DOUBLE_EQ(a.row(1).norm(), 5.0);
}

}  // namespace
}  // namespace alidade::internal
