// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/covariance.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "alidade/base/random.h"
#include "alidade/state/projection.h"
#include "alidade/state/tiles.h"

namespace alidade {
namespace {

using internal::AddOuterProduct;
using internal::Copy;
using internal::Joseph;
using internal::Panels;
using internal::TakePanels;

Eigen::MatrixXd RandomMatrix(int rows, int columns, Random& random) {
  Eigen::MatrixXd m(rows, columns);
  for (int c = 0; c < columns; ++c) {
    for (int r = 0; r < rows; ++r) m(r, c) = random.Normal();
  }
  return m;
}

/// A covariance of blocks of the given sizes, all correlated, and its dense copy.
Covariance Make(const std::vector<int>& sizes, Random& random) {
  Covariance p;
  std::vector<int> offsets;
  int n = 0;
  for (const int size : sizes) {
    offsets.push_back(p.Add(size));
    n += size;
  }
  const Eigen::MatrixXd a = RandomMatrix(n, n, random);
  p.SetBlock(0, 0, a * a.transpose());
  return p;
}

constexpr double kRounding = 1e-12;  // products of order 10 numbers of order 10

TEST(Covariance, BlocksAreThoseOfTheSymmetricMatrix) {
  Random random(1);
  const Covariance p = Make({2, 3, 1}, random);
  const Eigen::MatrixXd dense = p.Dense();
  EXPECT_EQ(dense, dense.transpose());
  EXPECT_EQ(p.Block(0, 2, 2, 3), dense.block(0, 2, 2, 3));
  EXPECT_EQ(p.Block(2, 3, 0, 2), dense.block(2, 0, 3, 2));
  EXPECT_EQ(p.Block(2, 3, 2, 3), dense.block(2, 2, 3, 3));
}

TEST(Covariance, ProjectEqualsTheDenseProduct) {
  Random random(2);
  const Covariance p = Make({2, 3, 1, 2}, random);
  const RowMajor h = RandomMatrix(2, 4, random);
  const std::vector<JacobianPart> parts = {{5, 1, 0}, {2, 3, 1}};
  Eigen::MatrixXd dense_h = Eigen::MatrixXd::Zero(2, 8);
  dense_h.middleCols(5, 1) = h.leftCols(1);
  dense_h.middleCols(2, 3) = h.rightCols(3);
  Eigen::MatrixXd pht(8, 2), s = Eigen::MatrixXd::Zero(2, 2);
  Project(p, {h.data(), 2, 4, parts}, pht.data(), s.data());
  EXPECT_LT((pht - p.Dense() * dense_h.transpose()).norm(), kRounding * pht.norm());
  EXPECT_LT((s - dense_h * pht).norm(), kRounding * pht.norm());
  Eigen::MatrixXd added = Eigen::MatrixXd::Identity(2, 2);
  AddProjection(p, {h.data(), 2, 4, parts}, added.data());
  EXPECT_LT((added - Eigen::MatrixXd::Identity(2, 2) - s).norm(), kRounding * pht.norm());
}

TEST(Covariance, ProjectOfSeveralRowsEqualsTheDenseProduct) {
  // Two blocks one after the other in P and in H, one that rows share, and one of a row's own; the
  // last row has one block twice.
  using Parts = std::vector<JacobianPart>;
  const std::vector<std::pair<int, Parts>> rows = {
      {2, {{0, 3, 0}, {3, 4, 3}, {20, 9, 7}}},
      {1, {{0, 3, 0}, {3, 4, 3}, {9, 2, 7}}},
      {2, {{3, 4, 0}, {20, 9, 4}}},
      {3, {{0, 3, 0}, {3, 4, 3}}},
      {1, {{30, 70, 0}, {3, 4, 70}, {3, 4, 75}, {20, 9, 80}}},
  };
  for (const std::vector<int>& blocks : {std::vector{3, 4, 2, 11, 9, 1, 70}, {100, 41}}) {
    Random random(4);
    Covariance p = Make(blocks, random);
    if (blocks.size() > 2) p.Release(9, 11);  // a gap, of zeros
    std::vector<RowMajor> data;
    std::vector<JacobianRows> all;
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(9, p.size());
    int at = 0;
    for (const auto& [count, parts] : rows) data.push_back(RandomMatrix(count, 90, random));
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto& [count, parts] = rows[i];
      all.push_back({data[i].data(), count, 90, parts});
      for (const JacobianPart& part : parts) {
        dense.block(at, part.offset, count, part.size) +=
            data[i].middleCols(part.column, part.size);
      }
      at += count;
    }
    const Eigen::MatrixXd whole = dense * p.Dense() * dense.transpose();
    at = 0;
    for (const JacobianRows& one : all) {  // S alone, without P H'
      Eigen::MatrixXd s = Eigen::MatrixXd::Ones(one.rows, one.rows);
      AddProjection(p, one, s.data());
      EXPECT_EQ(s, s.transpose());
      s.array() -= 1.0;
      EXPECT_LT((s - whole.block(at, at, one.rows, one.rows)).norm(), kRounding * whole.norm());
      at += one.rows;
    }
    Workspace work;
    const Panels panels = TakePanels(work, p.size(), 9);
    Project(p, all, panels);
    Eigen::MatrixXd pht(p.size(), 9);
    Copy(panels, pht);
    EXPECT_LT((pht - p.Dense() * dense.transpose()).norm(), kRounding * pht.norm());
  }
}

TEST(Covariance, AddProjectionOfManyRowsEqualsTheDenseProduct) {
  Random random(6);
  const Covariance p = Make({3, 4, 30}, random);
  const RowMajor h = RandomMatrix(5, 37, random);
  const std::vector<JacobianPart> parts = {{3, 4, 0}, {7, 30, 4}, {0, 3, 34}};
  Eigen::MatrixXd dense(5, 37);
  dense << h.rightCols(3), h.leftCols(34);
  Eigen::MatrixXd s = Eigen::MatrixXd::Zero(5, 5);
  AddProjection(p, {h.data(), 5, 37, parts}, s.data());
  const Eigen::MatrixXd expected = dense * p.Dense() * dense.transpose();
  EXPECT_LT((s - expected).norm(), kRounding * expected.norm());
}

TEST(Covariance, ProjectOfFewStatesEqualsTheDenseProduct) {
  Random random(5);
  const Covariance p = Make({2, 3}, random);
  const RowMajor h = RandomMatrix(3, 5, random);
  const std::vector<JacobianPart> parts = {{0, 2, 0}, {2, 3, 2}};
  const JacobianRows rows{h.data(), 3, 5, parts, true};
  Eigen::MatrixXd pht(5, 3), s = Eigen::MatrixXd::Zero(3, 3), added = s;
  Project(p, rows, pht.data(), s.data());
  EXPECT_LT((pht - p.Dense() * h.transpose()).norm(), kRounding * pht.norm());
  EXPECT_LT((s - h * pht).norm(), kRounding * pht.norm());
  AddProjection(p, rows, added.data());
  EXPECT_LT((added - h * p.Dense() * h.transpose()).norm(), kRounding * pht.norm());
}

TEST(Covariance, PropagateEqualsTheDenseFormForScatteredRows) {
  Random random(3);
  Covariance p = Make({2, 3, 1, 2}, random);
  const Eigen::MatrixXd before = p.Dense();
  const RowMajor f = RandomMatrix(3, 3, random);
  const Eigen::MatrixXd root = RandomMatrix(3, 1, random);
  const RowMajor q = root * root.transpose();
  p.Propagate(std::vector<JacobianPart>{{6, 2, 0}, {5, 1, 2}}, f.data(), q.data());
  // Gathered rows 6, 7, 5 in this order.
  const std::vector<int> rows = {6, 7, 5};
  Eigen::MatrixXd whole_f = Eigen::MatrixXd::Identity(8, 8);
  Eigen::MatrixXd whole_q = Eigen::MatrixXd::Zero(8, 8);
  whole_f(rows, rows) = f;
  whole_q(rows, rows) = root * root.transpose();
  const Eigen::MatrixXd expected = whole_f * before * whole_f.transpose() + whole_q;
  EXPECT_LT((p.Dense() - expected).norm(), kRounding * expected.norm());
}

TEST(Covariance, JosephAndTheOuterProductAgreeForTheOptimalGain) {
  Random random(4);
  Covariance a = Make({4}, random);
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

// Of a gain that is zero for some rows and wrong for the others, as the definition has it; and by
// what the optimal one would have taken: P - W W' + E E', E = (K - K*) L.
TEST(Covariance, JosephAndTheOuterProductsAgreeForAnyGain) {
  Random random(14);
  Covariance joseph = Make({3, 2, 3}, random);
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
  Covariance p = Make({2, 3, 2, 1}, random);
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
  Covariance p = Make({2, 3, 1}, random);
  p.Release(2, 3);
  p.Release(5, 1);
  EXPECT_EQ(p.size(), 2);
}

TEST(Covariance, MoveCarriesCorrelationsAlong) {
  Random random(7);
  Covariance p = Make({2, 2, 1, 2}, random);
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
