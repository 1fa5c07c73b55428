// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/covariance.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "alidade/state/tiles.h"
#include "random_matrices.h"

namespace alidade {
namespace {

using internal::AddOuterProduct;
using internal::Joseph;

constexpr double kRounding = 1e-12;  // sums of 10 products of order 100

TEST(Covariance, BlocksAreThoseOfTheSymmetricMatrix) {
  Random random(1);
  const Covariance p = RandomCovariance({2, 3, 1}, random);
  const Eigen::MatrixXd dense = p.Dense();
  EXPECT_EQ(dense, dense.transpose());
  EXPECT_EQ(p.Block(0, 2, 2, 3), dense.block(0, 2, 2, 3));
  EXPECT_EQ(p.Block(2, 3, 0, 2), dense.block(2, 0, 3, 2));
  EXPECT_EQ(p.Block(2, 3, 2, 3), dense.block(2, 2, 3, 3));
}

TEST(Covariance, PropagateEqualsTheDenseFormForScatteredRows) {
  Random random(3);
  Covariance p = RandomCovariance({2, 3, 1, 2}, random);
  const Eigen::MatrixXd before = p.Dense();
  const RowMajor f = RandomMatrix(3, 3, random);
  const Eigen::MatrixXd root = RandomMatrix(3, 1, random);
  const std::vector<int> rows = {6, 7, 5};
  EXPECT_TRUE(p.Propagate(rows, f.data(), root.data(), 1));
  Eigen::MatrixXd whole_f = Eigen::MatrixXd::Identity(8, 8);
  Eigen::MatrixXd whole_q = Eigen::MatrixXd::Zero(8, 8);
  whole_f(rows, rows) = f;
  whole_q(rows, rows) = root * root.transpose();
  const Eigen::MatrixXd expected = whole_f * before * whole_f.transpose() + whole_q;
  EXPECT_LT((p.Dense() - expected).norm(), kRounding * expected.norm());
}

TEST(Covariance, JosephAndTheOuterProductAgreeForTheOptimalGain) {
  Random random(4);
  Covariance a = RandomCovariance({4}, random);
  Covariance b = a;
  const Eigen::MatrixXd h = RandomMatrix(2, 4, random), r = Eigen::MatrixXd::Identity(2, 2);
  const Eigen::MatrixXd pht = a.Dense() * h.transpose();
  const Eigen::MatrixXd s = h * pht + r;
  const Eigen::MatrixXd gain = pht * s.inverse();
  const Eigen::LLT<Eigen::MatrixXd> llt(s);
  Workspace work;
  AddOuterProduct(a.lower(), llt.matrixL().solve(pht.transpose()).transpose(), -1.0);
  Joseph(b.lower(), gain, h, r, work);
  EXPECT_LT((a.Dense() - b.Dense()).norm(), 1e-11 * a.Dense().norm());
}

// The gain is zero for some rows and not optimal for the others. Joseph's form must equal the
// formula relative to the optimal gain K*: P - W W' + E E', E = (K - K*) L.
TEST(Covariance, JosephAndTheOuterProductsAgreeForAnyGain) {
  Random random(14);
  Covariance joseph = RandomCovariance({3, 2, 3}, random);
  Covariance outer = joseph;
  const Eigen::MatrixXd p = joseph.Dense(), h = RandomMatrix(3, 8, random);
  const Eigen::MatrixXd root = RandomMatrix(3, 3, random), r = root * root.transpose();
  const Eigen::LLT<Eigen::MatrixXd> s(h * p * h.transpose() + r);
  const Eigen::MatrixXd l = s.matrixL(), w = s.matrixL().solve(h * p).transpose();
  const Eigen::MatrixXd optimal = s.solve(h * p).transpose();
  Eigen::MatrixXd gain = optimal + 0.1 * RandomMatrix(8, 3, random);
  gain.middleRows(3, 2).setZero();

  const Eigen::MatrixXd kept = Eigen::MatrixXd::Identity(8, 8) - gain * h;
  const Eigen::MatrixXd expected = kept * p * kept.transpose() + gain * r * gain.transpose();
  Workspace work;
  Joseph(joseph.lower(), gain, h, r, work);
  EXPECT_LT((joseph.Dense() - expected).norm(), 1e-13 * p.norm());
  AddOuterProduct(outer.lower(), w, -1.0);
  const std::vector<int> rows = {0, 1, 2, 3, 4, 5, 6, 7};
  AddOuterProduct(outer.lower(), rows, (gain - optimal) * l);
  EXPECT_LT((outer.Dense() - expected).norm(), 1e-12 * p.norm());
}

TEST(Covariance, ReleasedRowsAreReusedAndLeaveNoTrace) {
  Random random(5);
  Covariance p = RandomCovariance({2, 3, 2, 1}, random);
  const Eigen::MatrixXd before = p.Dense();
  p.Release(2, 3);
  EXPECT_EQ(p.size(), 8);
  EXPECT_EQ(p.Block(2, 3, 2, 3).norm(), 0.0);
  EXPECT_EQ(p.Block(0, 2, 5, 2), before.block(0, 5, 2, 2));
  EXPECT_EQ(p.Add(3), 2);
  EXPECT_EQ(p.Block(2, 3, 5, 2).norm(), 0.0);
}

TEST(Covariance, ReleasingTheEndShrinksPastOlderGaps) {
  Random random(6);
  Covariance p = RandomCovariance({2, 3, 1}, random);
  p.Release(2, 3);
  p.Release(5, 1);
  EXPECT_EQ(p.size(), 2);
}

TEST(Covariance, MoveCarriesCorrelationsAlong) {
  Random random(7);
  Covariance p = RandomCovariance({2, 2, 1, 2}, random);
  const Eigen::MatrixXd before = p.Dense();
  p.Release(0, 2);
  EXPECT_EQ(p.MoveToGap(5, 2), 0);
  EXPECT_EQ(p.size(), 5);
  EXPECT_EQ(p.Block(0, 2, 0, 2), before.block(5, 5, 2, 2));
  EXPECT_EQ(p.Block(0, 2, 2, 2), before.block(5, 2, 2, 2));
  EXPECT_EQ(p.Block(4, 1, 0, 2), before.block(4, 5, 1, 2));
  EXPECT_EQ(p.Block(4, 1, 2, 2), before.block(4, 2, 1, 2));
}

}  // namespace
}  // namespace alidade
