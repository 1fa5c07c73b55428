// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/projection.h"

#include <gtest/gtest.h>

#include "random_matrices.h"

namespace alidade {
namespace {

constexpr double kProductTolerance = 1e-12;  // sums of 10 products of order 100

TEST(Projection, EqualsTheDenseProduct) {
  Random random(4);
  Covariance p = RandomCovariance({3, 4, 2, 11, 9, 1, 70}, random);
  p.Release(9, 11);  // these rows and columns become zero
  // The columns are in arbitrary order. One of the lists contains a column twice.
  for (const std::vector<int>& columns :
       {std::vector{5}, {0, 1, 2}, {25, 3, 99, 4}, {4, 30, 4, 22, 21}}) {
    for (const int m : {1, 2, 5}) {
      const RowMajor h = RandomMatrix(m, std::ssize(columns), random);
      Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(m, p.size());
      for (std::size_t c = 0; c < columns.size(); ++c) {
        dense.col(columns[c]) += h.col(static_cast<Eigen::Index>(c));
      }
      const Eigen::MatrixXd expected = p.Dense() * dense.transpose(), s = dense * expected;
      Eigen::MatrixXd pht(p.size(), m), sum = Eigen::MatrixXd::Ones(m, m), alone = sum;
      Project(p, {h.data(), m, columns}, pht.data(), sum.data());
      EXPECT_LT((pht - expected).norm(), kProductTolerance * expected.norm());
      EXPECT_LT((sum.array() - 1.0 - s.array()).matrix().norm(),
                kProductTolerance * (1.0 + s.norm()));
      AddProjection(p, {h.data(), m, columns}, alone.data());
      EXPECT_EQ(alone, alone.transpose());
      EXPECT_LT((alone - sum).norm(), kProductTolerance * (1.0 + s.norm()));
    }
  }
}

}  // namespace
}  // namespace alidade
