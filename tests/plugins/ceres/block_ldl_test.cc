// SPDX-License-Identifier: Apache-2.0
#include "plugins/ceres/batch/block_ldl.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <numeric>

#include "alidade/base/random.h"
#include "plugins/ceres/batch/elimination.h"

namespace alidade::ceres_batch {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// System of pairs (x_k, lambda_k) along a chain, and of points that some of the x_k observe:
///
///   [H A'; A -Q],   A x = (x_k - F_k x_{k-1}),   Q_k of rank 0, 1 or full
///
/// H contains only the observations of the points.
class Chain {
 public:
  Chain(int steps, int points, int span = 4) {
    for (int k = 0; k < steps; ++k) {
      x_.push_back(ldl_.AddVariable(3));
      lambda_.push_back(ldl_.AddVariable(3));
      xx_.push_back(ldl_.AddBlock(x_.back(), x_.back()));
      ll_.push_back(ldl_.AddBlock(lambda_.back(), lambda_.back()));
      lx_.push_back(ldl_.AddBlock(lambda_.back(), x_.back()));
      before_.push_back(k == 0 ? 0 : ldl_.AddBlock(lambda_.back(), x_[x_.size() - 2]));
      time_.push_back({x_.back(), lambda_.back()});
    }
    for (int i = 0; i < points; ++i) {
      y_.push_back(ldl_.AddVariable(2));
      yy_.push_back(ldl_.AddBlock(y_.back(), y_.back()));
      for (int k = i % steps; k < std::min(steps, i % steps + span); ++k) {
        seen_.push_back({i, k, ldl_.AddBlock(y_.back(), x_[static_cast<std::size_t>(k)])});
      }
      time_.push_back({y_.back()});
    }
  }
  BlockLdl& ldl() { return ldl_; }
  const Groups& time() const { return time_; }

  /// Sets the elimination order and the values. Also fills the dense matrix with the same values.
  void Fill(const Groups& order) {
    ldl_.Use(Elimination(ldl_.graph(), order));
    Random random(3);
    const auto matrix = [&](int rows, int columns) {
      return MatrixXd(MatrixXd::NullaryExpr(rows, columns, [&] { return random.Normal(); }));
    };
    for (std::size_t k = 0; k < x_.size(); ++k) {
      const int rank = k == 0 ? 3 : static_cast<int>(k) % 4;
      const MatrixXd b = matrix(3, rank);
      ldl_.Block(ll_[k]) = -b * b.transpose();
      ldl_.Block(lx_[k]).setIdentity();
      if (k > 0) ldl_.Block(before_[k]) = -0.5 * matrix(3, 3);
    }
    for (const std::size_t yy : yy_) ldl_.Block(yy).setIdentity();  // prior of the point
    for (const auto& [i, k, block] : seen_) {
      const MatrixXd j_x = matrix(2, 3), j_y = matrix(2, 2);
      ldl_.Block(xx_[static_cast<std::size_t>(k)]) += j_x.transpose() * j_x;
      ldl_.Block(yy_[static_cast<std::size_t>(i)]) += j_y.transpose() * j_y;
      ldl_.Block(block) = j_y.transpose() * j_x;
    }
    dense_.setZero(ldl_.size(), ldl_.size());
    const auto put = [&](std::size_t block, int i, int j) {
      dense_.block(ldl_.RowOf(i), ldl_.RowOf(j), ldl_.SizeOf(i), ldl_.SizeOf(j)) =
          ldl_.Block(block);
      dense_.block(ldl_.RowOf(j), ldl_.RowOf(i), ldl_.SizeOf(j), ldl_.SizeOf(i)) =
          ldl_.Block(block).transpose();
    };
    for (std::size_t k = 0; k < x_.size(); ++k) {
      put(xx_[k], x_[k], x_[k]);
      put(ll_[k], lambda_[k], lambda_[k]);
      put(lx_[k], lambda_[k], x_[k]);
      if (k > 0) put(before_[k], lambda_[k], x_[k - 1]);
    }
    for (std::size_t i = 0; i < y_.size(); ++i) put(yy_[i], y_[i], y_[i]);
    for (const auto& [i, k, block] : seen_) {
      put(block, y_[static_cast<std::size_t>(i)], x_[static_cast<std::size_t>(k)]);
    }
  }
  const MatrixXd& dense() const { return dense_; }

  void ExpectSolvesAndInverts() {
    ASSERT_TRUE(ldl_.Factorise());
    const VectorXd b = VectorXd::LinSpaced(ldl_.size(), -1.0, 1.0);
    const MatrixXd inverse = dense_.fullPivLu().inverse();
    const double scale = inverse.cwiseAbs().maxCoeff();
    EXPECT_LT((ldl_.Solve(b, 1) - inverse * b).cwiseAbs().maxCoeff(), 1e-10 * scale);
    std::vector<std::pair<int, int>> blocks;
    for (std::size_t v = 0; v < ldl_.graph().size.size(); ++v) blocks.emplace_back(v, v);
    blocks.insert(blocks.end(), ldl_.graph().edges.begin(), ldl_.graph().edges.end());
    const std::vector<MatrixXd> found = ldl_.Inverse(blocks);
    for (std::size_t n = 0; n < blocks.size(); ++n) {
      const auto [i, j] = blocks[n];
      const MatrixXd expected =
          inverse.block(ldl_.RowOf(i), ldl_.RowOf(j), ldl_.SizeOf(i), ldl_.SizeOf(j));
      EXPECT_LT((found[n] - expected).cwiseAbs().maxCoeff(), 1e-10 * scale) << i << ' ' << j;
    }
  }

 private:
  struct Seen {
    int point, step;
    std::size_t block;
  };
  BlockLdl ldl_;
  std::vector<int> x_, lambda_, y_;
  std::vector<std::size_t> xx_, ll_, lx_, before_, yy_;
  std::vector<Seen> seen_;
  Groups time_;
  MatrixXd dense_;
};

TEST(BlockLdl, EqualsTheDenseInverseInAnyOrderOfWholePairs) {
  Chain chain(23, 17);
  const Groups& time = chain.time();
  chain.Fill(time);
  chain.ExpectSolvesAndInverts();
  chain.Fill(Groups(time.rbegin(), time.rend()));
  chain.ExpectSolvesAndInverts();
  chain.Fill(MinimumDegree(chain.ldl().graph(), time));
  chain.ExpectSolvesAndInverts();
}

// All pairs of the chain observe the same 60 points. The border of each pair is therefore wide.
TEST(Elimination, ChainsWithAWideBorderAreMerged) {
  Chain chain(60, 60, 60);
  const Groups& time = chain.time();
  Groups pairs_first(time.begin(), time.begin() + 60);
  pairs_first.insert(pairs_first.end(), time.begin() + 60, time.end());
  const Elimination elimination(chain.ldl().graph(), pairs_first);
  EXPECT_LT(elimination.fronts.size(), 30u);
  for (const Elimination::Front& front : elimination.fronts) EXPECT_LE(front.p, 96);
  chain.Fill(pairs_first);
  chain.ExpectSolvesAndInverts();
}

TEST(BlockLdl, ASingularPivotIsSaidNotPerturbed) {
  BlockLdl ldl;
  const int x = ldl.AddVariable(2);
  ldl.AddBlock(x, x);
  ldl.Use(Elimination(ldl.graph(), {{x}}));
  EXPECT_FALSE(ldl.Factorise());
}

// All steps observe one point. If it is eliminated first, it connects all steps with each other.
TEST(MinimumDegree, PutsAHubLast) {
  Chain chain(200, 1, 200);
  Groups hub_first = chain.time();
  std::rotate(hub_first.begin(), hub_first.end() - 1, hub_first.end());
  const BlockGraph& graph = chain.ldl().graph();
  EXPECT_LT(100.0 * Elimination(graph, MinimumDegree(graph, hub_first)).flops,
            Elimination(graph, hub_first).flops);
}

TEST(MinimumDegree, LeavesTheLastWhereItIs) {
  Chain chain(50, 1, 50);
  Groups groups = chain.time();
  std::ranges::reverse(groups);  // the last group is then one end of the chain
  const Groups ordered = MinimumDegree(chain.ldl().graph(), groups);
  EXPECT_EQ(ordered.back(), groups.back());
  EXPECT_EQ(ordered.size(), groups.size());
}

}  // namespace
}  // namespace alidade::ceres_batch
