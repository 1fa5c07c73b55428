// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/state/covariance.h"
#include "alidade/state/eigen_alignment.h"
#include "alidade/state/manifold.h"

namespace alidade {

/// Index of a block in its layout; stays valid while other blocks come and go.
using BlockId = int;

/// What the estimator does with a block: correct it; keep it and its correlations, never correct it
/// (Schmidt); take it as known.
enum class BlockStatus { kEstimated, kConsider, kConstant };

/// One named part of the state.
struct Block {
  std::string name;   ///< `owner.block`, as in `target.depth`
  std::string owner;  ///< the entry of the config that brought it
  Space space;
  BlockStatus status = BlockStatus::kEstimated;
  bool present = false;     ///< has a value; else declared only, waiting to be initialised
  int value_offset = -1;    ///< into State::values(), where present or reserved
  int tangent_offset = -1;  ///< into Covariance, where present or reserved, and not constant

  const Geometry& geometry() const { return space.geometry; }
  bool has_covariance() const { return present && status != BlockStatus::kConstant; }
};

/// Names, geometries and places of the blocks; knows no values.
class StateLayout {
 public:
  /// Adds a block without a value; ContractViolation where the name is taken.
  BlockId Declare(std::string_view name, std::string_view owner, const Space& space,
                  BlockStatus status = BlockStatus::kEstimated);
  const std::vector<Block>& blocks() const { return blocks_; }
  const Block& operator[](BlockId id) const { return blocks_[static_cast<std::size_t>(id)]; }
  Block& operator[](BlockId id) { return blocks_[static_cast<std::size_t>(id)]; }
  /// -1 where there is none.
  BlockId Find(std::string_view name) const;
  /// Takes a block away: one that is declared later may have its id.
  void Drop(BlockId id);

 private:
  std::vector<Block> blocks_;
  std::vector<BlockId> dropped_;  ///< their places wait for the next block
};

/// A block of a state: its value, ambient, and the standard deviations of its tangent.
struct BlockEstimate {
  Eigen::VectorXd value, sigma;
};

/// Layout, values and covariance of the blocks, kept consistent. Copying it is a snapshot.
///
/// x is one buffer of ambient values, P the covariance in the tangent. Adding or removing
/// a block moves O(n) numbers: a removed block leaves a gap that the last block fills where it is
/// no larger, or that a later one takes. A block that has a value takes another one in place.
class State {
 public:
  explicit State(StateLayout layout = {}) : layout_(std::move(layout)) {}

  const StateLayout& layout() const { return layout_; }
  const Covariance& covariance() const { return covariance_; }
  Covariance& covariance() { return covariance_; }

  /// The ambient value of a present block; valid until a block is added or values() is replaced.
  const double* value(BlockId id) const { return values_.data() + layout_[id].value_offset; }
  /// The standard deviation of element i of a present block, in its tangent; 0 if it is constant.
  double sigma(BlockId id, int i = 0) const;
  /// ContractViolation if the block is not present.
  BlockEstimate Estimate(BlockId id) const;
  const std::vector<double>& values() const { return values_; }
  std::vector<double>& values() { return values_; }

  /// Declares a block of a dynamic state (a landmark, a clone).
  BlockId Declare(std::string_view name, std::string_view owner, const Space& space,
                  BlockStatus status = BlockStatus::kEstimated) {
    return layout_.Declare(name, owner, space, status);
  }
  /// Gives a declared block the place that its value will have, and rows of zeros.
  void Reserve(BlockId id);
  /// Gives a declared block a value and a covariance (tangent, row-major; ignored where constant),
  /// uncorrelated with the rest.
  void Add(BlockId id, const double* value, const ConstMatrix& covariance);
  /// Gives declared blocks the values y = g(x, n), one after the other, with dy = J dx + J_n dn:
  /// their covariance is J P_xx J' + own, their correlation with the rest J P_x. `from` names the
  /// blocks of x, none of them among `ids`; J has the columns of their tangents side by side,
  /// row-major; `own` = J_n Cov(n) J_n'.
  void Initialise(std::span<const BlockId> ids, const double* values, std::span<const BlockId> from,
                  const Eigen::Ref<const RowMajor>& jacobian, const ConstMatrix& own);
  /// Drops the block, with its id: a block declared later may have it. The rest keeps its value and
  /// covariance.
  void Drop(BlockId id);
  /// moved = the values x_i (+) dx_i of all blocks with a covariance, the rest as it is; dx is
  /// indexed like the covariance. Changes nothing: see MoveTo. Whether they are finite.
  bool Retract(const double* dx, std::vector<double>& moved) const;
  /// Takes the values over, transporting P where the tangent basis of a block turns with its value.
  /// They stay where they are in memory.
  void MoveTo(const std::vector<double>& values);

 private:
  void PlaceValue(BlockId id, const double* value);
  int FindRows(std::span<const BlockId> blocks);
  void Release(BlockId id);
  void FillGaps();
  bool RetractBlocks(const double* dx, std::vector<double>& moved) const;
  void TurnTangents(const std::vector<double>& values);

  StateLayout layout_;
  std::vector<double> values_;
  std::vector<std::pair<int, int>> value_gaps_;  ///< (offset, size)
  Covariance covariance_;
  std::vector<BlockId> placed_;  ///< that have rows of P, ascending
  bool flat_ = true;  ///< x (+) dx is x + dx: vectors alone, at the same places in x and P
  Scratch<Workspace> memory_;
  // Of the blocks that FindRows was asked for.
  Scratch<std::vector<int>> rows_;     ///< of P
  Scratch<std::vector<int>> columns_;  ///< of a Jacobian that has one for each element of them
};

/// J (n x n, in `work`) of state.MoveTo(values): dx there = J dx here.
Workspace::Matrix TransportTo(const State& state, const std::vector<double>& values,
                              Workspace& work);

}  // namespace alidade
