// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <cstddef>
#include <utility>
#include <vector>

#include "elimination.h"

namespace alidade::ceres_batch {

/// A symmetric indefinite matrix M in dense blocks, factorised as M = L D L', D of whole pivots, by
/// the fronts of an Elimination (multifrontal [Duff1983]).
///
/// Rows are exchanged within the pivots of a front only: the caller's groups must be such that each
/// of them is nonsingular where it comes up. No pivot is perturbed.
class BlockLdl {
 public:
  /// A variable of so many rows: its index.
  int AddVariable(int size);
  /// Makes room for the block (i, j), which with i != j stands for (j, i) too: its index.
  std::size_t AddBlock(int i, int j);
  /// The values of a block, size(i) x size(j), zero at first.
  Eigen::Map<Eigen::MatrixXd> Block(std::size_t block);
  Eigen::Map<const Eigen::MatrixXd> Block(std::size_t block) const;
  void SetZero() { values_.setZero(); }

  const BlockGraph& graph() const { return graph_; }
  /// The first of its rows in a vector.
  int RowOf(int variable) const { return rows_[static_cast<std::size_t>(variable)]; }
  int SizeOf(int variable) const { return graph_.size[static_cast<std::size_t>(variable)]; }
  int size() const { return size_; }

  /// Sets the order in which it is factorised, once all blocks are there.
  void Use(Elimination elimination);
  const Elimination& elimination() const { return elimination_; }
  /// False where a pivot is singular or not finite.
  bool Factorise();
  /// x = M^-1 b, refined so many times by the residual.
  Eigen::VectorXd Solve(const Eigen::VectorXd& b, int refinements = 0) const;
  /// M x.
  Eigen::VectorXd Multiply(const Eigen::VectorXd& x) const;
  /// The blocks (i, j) of M^-1, in their order. Each must be of a block of M, or on the diagonal.
  /// By the recursion of Takahashi [Takahashi1973].
  std::vector<Eigen::MatrixXd> Inverse(const std::vector<std::pair<int, int>>& blocks);

 private:
  struct Place {
    int i, j;
    Eigen::Index at;
  };
  struct Factor {
    std::vector<std::size_t> blocks;         ///< of M that are assembled here
    Eigen::PartialPivLU<Eigen::MatrixXd> d;  ///< D
    Eigen::MatrixXd x;                       ///< D^-1 B', p x m
    Eigen::MatrixXd update;                  ///< lower triangle; until the parent has taken it
  };
  using Front = Elimination::Front;

  void Locate(const Front& front);
  void Extend(const Front& child, const Eigen::MatrixXd& update, Eigen::MatrixXd& into) const;
  void SolveOnce(Eigen::VectorXd& b) const;
  Eigen::VectorXd Gather(const std::vector<int>& variables, int rows,
                         const Eigen::VectorXd& from) const;
  template <class Visit>
  void ForEachPart(const std::vector<int>& variables, Visit visit) const;

  BlockGraph graph_;
  std::vector<int> rows_;
  int size_ = 0;
  std::vector<Place> places_;
  Eigen::VectorXd values_;
  Eigen::Index used_ = 0;
  Elimination elimination_;
  std::vector<Factor> factors_;  ///< by front
  std::vector<int> local_;       ///< by variable: its first row in the front located last
};

}  // namespace alidade::ceres_batch
