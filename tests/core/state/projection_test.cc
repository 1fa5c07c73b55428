// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/projection.h"

#include <gtest/gtest.h>

#include "alidade/state/tiles.h"
#include "random_matrices.h"

namespace alidade {
namespace {

using internal::Copy;
using internal::Panels;
using internal::TakePanels;

constexpr double kTolerance = 1e-12;  // products of order 10 numbers of order 10

TEST(Projection, ProjectEqualsTheDenseProduct) {
  Random random(2);
  const Covariance p = RandomCovariance({2, 3, 1, 2}, random);
  const RowMajor h = RandomMatrix(2, 4, random);
  const std::vector<JacobianPart> parts = {{5, 1, 0}, {2, 3, 1}};
  Eigen::MatrixXd dense_h = Eigen::MatrixXd::Zero(2, 8);
  dense_h.middleCols(5, 1) = h.leftCols(1);
  dense_h.middleCols(2, 3) = h.rightCols(3);
  Eigen::MatrixXd pht(8, 2), s = Eigen::MatrixXd::Zero(2, 2);
  Project(p, {h.data(), 2, 4, parts}, pht.data(), s.data());
  EXPECT_LT((pht - p.Dense() * dense_h.transpose()).norm(), kTolerance * pht.norm());
  EXPECT_LT((s - dense_h * pht).norm(), kTolerance * pht.norm());
  Eigen::MatrixXd added = Eigen::MatrixXd::Identity(2, 2);
  AddProjection(p, {h.data(), 2, 4, parts}, added.data());
  EXPECT_LT((added - Eigen::MatrixXd::Identity(2, 2) - s).norm(), kTolerance * pht.norm());
}

TEST(Projection, ProjectOfSeveralRowsEqualsTheDenseProduct) {
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
    Covariance p = RandomCovariance(blocks, random);
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
      EXPECT_LT((s - whole.block(at, at, one.rows, one.rows)).norm(), kTolerance * whole.norm());
      at += one.rows;
    }
    Workspace work;
    const Panels panels = TakePanels(work, p.size(), 9);
    Project(p, all, panels);
    Eigen::MatrixXd pht(p.size(), 9);
    Copy(panels, pht);
    EXPECT_LT((pht - p.Dense() * dense.transpose()).norm(), kTolerance * pht.norm());
  }
}

TEST(Projection, AddProjectionOfManyRowsEqualsTheDenseProduct) {
  Random random(6);
  const Covariance p = RandomCovariance({3, 4, 30}, random);
  const RowMajor h = RandomMatrix(5, 37, random);
  const std::vector<JacobianPart> parts = {{3, 4, 0}, {7, 30, 4}, {0, 3, 34}};
  Eigen::MatrixXd dense(5, 37);
  dense << h.rightCols(3), h.leftCols(34);
  Eigen::MatrixXd s = Eigen::MatrixXd::Zero(5, 5);
  AddProjection(p, {h.data(), 5, 37, parts}, s.data());
  const Eigen::MatrixXd expected = dense * p.Dense() * dense.transpose();
  EXPECT_LT((s - expected).norm(), kTolerance * expected.norm());
}

TEST(Projection, ProjectOfFewStatesEqualsTheDenseProduct) {
  Random random(5);
  const Covariance p = RandomCovariance({2, 3}, random);
  const RowMajor h = RandomMatrix(3, 5, random);
  const std::vector<JacobianPart> parts = {{0, 2, 0}, {2, 3, 2}};
  const JacobianRows rows{h.data(), 3, 5, parts, true};
  Eigen::MatrixXd pht(5, 3), s = Eigen::MatrixXd::Zero(3, 3), added = s;
  Project(p, rows, pht.data(), s.data());
  EXPECT_LT((pht - p.Dense() * h.transpose()).norm(), kTolerance * pht.norm());
  EXPECT_LT((s - h * pht).norm(), kTolerance * pht.norm());
  AddProjection(p, rows, added.data());
  EXPECT_LT((added - h * p.Dense() * h.transpose()).norm(), kTolerance * pht.norm());
}

}  // namespace
}  // namespace alidade
