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

/// Index of a block in its layout. The index stays valid when other blocks are added or removed.
using BlockId = int;

/// Status of a block, which determines the treatment of the block by the estimator.
enum class BlockStatus {
  kEstimated,  ///< updates correct the block
  kConsider,   ///< the block has a covariance and correlations, but no update corrects it (Schmidt)
  kConstant,   ///< the block is known exactly
};

/// Named part of the state.
struct Block {
  std::string name;   ///< `owner.block`, such as `target.depth`
  std::string owner;  ///< entry of the config that defines the block
  Space space;
  BlockStatus status = BlockStatus::kEstimated;
  bool present = false;   ///< whether the block has a value; false until it is initialised
  int value_offset = -1;  ///< offset in State::values(); -1 unless present or reserved
  /// Offset in Covariance; -1 if the block is constant, or neither present nor reserved.
  int tangent_offset = -1;

  const Geometry& geometry() const { return space.geometry; }
  bool has_covariance() const { return present && status != BlockStatus::kConstant; }
};

/// Names, geometries and offsets of the blocks, without their values.
class StateLayout {
 public:
  /// Adds a block without a value. ContractViolation if another block has this name.
  BlockId Declare(std::string_view name, std::string_view owner, const Space& space,
                  BlockStatus status = BlockStatus::kEstimated);
  const std::vector<Block>& blocks() const { return blocks_; }
  const Block& operator[](BlockId id) const { return blocks_[static_cast<std::size_t>(id)]; }
  Block& operator[](BlockId id) { return blocks_[static_cast<std::size_t>(id)]; }
  /// Returns the block with this name, or -1.
  BlockId Find(std::string_view name) const;
  /// Removes a block. A block that is declared later may reuse the id.
  void Remove(BlockId id);

 private:
  std::vector<Block> blocks_;
  std::vector<BlockId> removed_;  ///< ids of removed blocks, which later blocks reuse
};

/// Estimate of a block: its ambient value, and the standard deviations of its tangent elements.
struct BlockEstimate {
  Eigen::VectorXd value, sigma;
};

/// State of an estimator: the layout, values and covariance of its blocks, which are always
/// consistent. A State can be copied.
///
/// x is one buffer of ambient values. P is the covariance in the tangent space. Adding or removing
/// a block moves O(n) numbers. A removed block leaves a gap. If the last block fits into the gap,
/// it is moved there. Otherwise a block that is added later may use the gap. Setting the value of a
/// block does not move the block in memory.
class State {
 public:
  explicit State(StateLayout layout = {}) : layout_(std::move(layout)) {}

  const StateLayout& layout() const { return layout_; }
  const Covariance& covariance() const { return covariance_; }
  Covariance& covariance() { return covariance_; }

  /// Returns the ambient value of a present block. The pointer is valid until a block is added or
  /// values() is replaced.
  const double* value(BlockId id) const { return values_.data() + layout_[id].value_offset; }
  /// Returns the standard deviation of tangent element i of a present block, or 0 if the block is
  /// constant.
  double sigma(BlockId id, int i = 0) const;
  /// Returns the estimate of a block. ContractViolation if the block is not present.
  BlockEstimate Estimate(BlockId id) const;
  const std::vector<double>& values() const { return values_; }
  std::vector<double>& values() { return values_; }

  /// Declares a block while the estimator runs, such as a landmark or a clone.
  BlockId Declare(std::string_view name, std::string_view owner, const Space& space,
                  BlockStatus status = BlockStatus::kEstimated) {
    return layout_.Declare(name, owner, space, status);
  }
  /// Reserves memory for the value of a declared block, and adds rows of zeros to the covariance.
  void Reserve(BlockId id);
  /// Sets the value and covariance of a declared block. Its correlations with other blocks become
  /// zero. The covariance is that of the tangent elements; it is ignored for a constant block.
  void Add(BlockId id, const double* value, const ConstMatrix& covariance);
  /// Initialises the declared blocks `ids` with y = g(x, n). `values` contains y, the concatenated
  /// values of these blocks. `sources` are the blocks of x, which must not be among `ids`. If dy =
  /// J dx + J_n dn, the covariance of y is J P_xx J' + noise_covariance, and the covariance of y
  /// with all other blocks is J P_x. J is row-major and has one column for each tangent element of
  /// the sources, in their order. noise_covariance is J_n Cov(n) J_n'.
  void Initialise(std::span<const BlockId> ids, const double* values,
                  std::span<const BlockId> sources, const Eigen::Ref<const RowMajor>& jacobian,
                  const ConstMatrix& noise_covariance);
  /// Removes a block. A block that is declared later may reuse the id. The values and covariances
  /// of the other blocks do not change.
  void Remove(BlockId id);
  /// Computes new_values: x_i (+) dx_i for each block with a covariance, and the current value of
  /// every other block. The indices of dx are the row indices of the covariance. The state does not
  /// change (see MoveTo). Returns true if all new values are finite.
  bool Retract(const double* dx, std::vector<double>& new_values) const;
  /// Sets all values, without moving them in memory. Transports P for each block whose tangent
  /// basis changes with its value.
  void MoveTo(const std::vector<double>& values);

 private:
  void PlaceValue(BlockId id, const double* value);
  int FindRows(std::span<const BlockId> blocks);
  void Release(BlockId id);
  void FillGaps();
  bool RetractBlocks(const double* dx, std::vector<double>& new_values) const;
  void TransportCovariance(const std::vector<double>& values);

  StateLayout layout_;
  std::vector<double> values_;
  std::vector<std::pair<int, int>> value_gaps_;  ///< offset and size of each gap
  Covariance covariance_;
  std::vector<BlockId> covariance_blocks_;  ///< blocks with rows in P, in ascending order
  /// True if x (+) dx = x + dx: all blocks are vectors with equal offsets in x and P.
  bool is_flat_ = true;
  Scratch<Workspace> memory_;
  // Results of FindRows().
  Scratch<std::vector<int>> rows_;  ///< rows of P
  /// Columns of a Jacobian that has one column for each tangent element of the blocks.
  Scratch<std::vector<int>> columns_;
};

/// Computes A <- J A with the Jacobian J of state.MoveTo(values). An error dx before the move
/// becomes J dx after the move. A has n rows.
void TransportRows(const State& state, const std::vector<double>& values,
                   Eigen::Ref<Eigen::MatrixXd> a);

}  // namespace alidade
