// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/tiles.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <limits>

#include "alidade/base/random.h"
#include "random_matrices.h"

namespace alidade::internal {
namespace {

using Eigen::MatrixXd;

/// Sizes below, at and above the size of one tile, and a size above that of two tiles.
constexpr Eigen::Index kSizes[] = {0, 1, 5, kTile - 1, kTile, kTile + 1, 2 * kTile + 7};

TEST(Tiles, ProductsAreThoseOfWholeMatrices) {
  Random random(1);
  for (const Eigen::Index n : kSizes) {
    for (const Eigen::Index k : {Eigen::Index{3}, kTile + 4}) {
      const MatrixXd a = RandomMatrix(n, k, random), b = RandomMatrix(k, 7, random);
      const MatrixXd c = RandomMatrix(n, 7, random);
      MatrixXd sum = c;
      AddProduct(sum, a, b, -1.0);
      EXPECT_LE((sum - (c - a * b)).norm(), 1e-12 * static_cast<double>(n)) << n << ' ' << k;
      const MatrixXd square = RandomMatrix(n, n, random);
      MatrixXd outer = square;
      AddOuterProduct(outer, a, 1.0);
      const MatrixXd expected = square + a * a.transpose();
      for (Eigen::Index i = 0; i < n; ++i) {
        for (Eigen::Index j = 0; j < n; ++j) {
          ASSERT_NEAR(outer(i, j), j <= i ? expected(i, j) : square(i, j), 1e-11) << i << ' ' << j;
        }
      }
    }
  }
}

TEST(Tiles, FactorsAndQuotientsMultiplyBack) {
  Random random(2);
  for (const Eigen::Index n : kSizes) {
    const MatrixXd a = RandomMatrix(n, n, random);
    const MatrixXd s = a * a.transpose() + static_cast<double>(n) * MatrixXd::Identity(n, n);
    MatrixXd l = s;
    ASSERT_TRUE(Factorise(l));
    const MatrixXd lower = l.triangularView<Eigen::Lower>();
    EXPECT_LE((lower * lower.transpose() - s).norm(), 1e-13 * s.norm()) << n;
    for (const Eigen::Index rows : {Eigen::Index{1}, kTile + 9}) {
      const MatrixXd b = RandomMatrix(rows, n, random);
      MatrixXd quotient = b;
      DivideByTransposed(l, quotient);
      EXPECT_LE((quotient * lower.transpose() - b).norm(), 1e-12 * b.norm()) << n << ' ' << rows;
      quotient = b;
      Divide(l, quotient);
      EXPECT_LE((quotient * lower - b).norm(), 1e-12 * b.norm()) << n << ' ' << rows;
    }
  }
}

TEST(Tiles, WhatHasNoFactorIsRefusedInEveryTile) {
  const Eigen::Index n = 2 * kTile + 7;
  for (const Eigen::Index at : {Eigen::Index{0}, kTile - 1, kTile, n - 1}) {
    for (const double wrong : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(),
                               std::numeric_limits<double>::infinity()}) {
      MatrixXd s = MatrixXd::Identity(n, n);
      s(at, at) = wrong;
      EXPECT_FALSE(Factorise(s)) << at << ' ' << wrong;
    }
  }
}

}  // namespace
}  // namespace alidade::internal
