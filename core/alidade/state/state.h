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

/// Index of a block in its layout. It stays valid when other blocks are added or removed.
using BlockId = int;

/// Treatment of a block by the estimator.
enum class BlockStatus {
  kEstimated,  ///< updates correct it
  kConsider,   ///< it has a covariance and correlations, but is never corrected (Schmidt)
  kConstant,   ///< it is known exactly
};

/// Named part of the state.
struct Block {
  std::string name;   ///< `owner.block`, as in `target.depth`
  std::string owner;  ///< entry of the config that defines it
  Space space;
  BlockStatus status = BlockStatus::kEstimated;
  bool present = false;     ///< has a value; false while the block is not initialised
  int value_offset = -1;    ///< in State::values(), if present or reserved
  int tangent_offset = -1;  ///< in Covariance, if present or reserved, and not constant

  const Geometry& geometry() const { return space.geometry; }
  bool has_covariance() const { return present && status != BlockStatus::kConstant; }
};

/// Names, geometries and offsets of the blocks, without their values.
class StateLayout {
 public:
  /// Adds a block without a value. ContractViolation if the name is in use.
  BlockId Declare(std::string_view name, std::string_view owner, const Space& space,
                  BlockStatus status = BlockStatus::kEstimated);
  const std::vector<Block>& blocks() const { return blocks_; }
  const Block& operator[](BlockId id) const { return blocks_[static_cast<std::size_t>(id)]; }
  Block& operator[](BlockId id) { return blocks_[static_cast<std::size_t>(id)]; }
  /// Returns the block of that name, or -1.
  BlockId Find(std::string_view name) const;
  /// Removes a block. A block that is declared later may reuse its id.
  void Remove(BlockId id);

 private:
  std::vector<Block> blocks_;
  std::vector<BlockId> removed_;  ///< reused by the next blocks
};

/// Estimate of a block: its ambient value and the standard deviations of its tangent.
struct BlockEstimate {
  Eigen::VectorXd value, sigma;
};

/// State: consistent layout, values and covariance of the blocks. Copyable.
///
/// x is one buffer of ambient values, P the covariance in the tangent. Adding or removing a block
/// moves O(n) numbers. A removed block leaves a gap. The last block fills it if it is not larger;
/// otherwise a later block may use it. Setting the value of a block does not move it.
class State {
 public:
  explicit State(StateLayout layout = {}) : layout_(std::move(layout)) {}

  const StateLayout& layout() const { return layout_; }
  const Covariance& covariance() const { return covariance_; }
  Covariance& covariance() { return covariance_; }

  /// Returns the ambient value of a present block. The pointer is valid until a block is added or
  /// values() is replaced.
  const double* value(BlockId id) const { return values_.data() + layout_[id].value_offset; }
  /// Returns the standard deviation of element i of a present block, in its tangent; 0 if the block
  /// is constant.
  double sigma(BlockId id, int i = 0) const;
  /// Returns the estimate of a block. ContractViolation if the block is not present.
  BlockEstimate Estimate(BlockId id) const;
  const std::vector<double>& values() const { return values_; }
  std::vector<double>& values() { return values_; }

  /// Declares a block of a dynamic state (a landmark, a clone).
  BlockId Declare(std::string_view name, std::string_view owner, const Space& space,
                  BlockStatus status = BlockStatus::kEstimated) {
    return layout_.Declare(name, owner, space, status);
  }
  /// Reserves the memory of a declared block's value, and zero rows of the covariance.
  void Reserve(BlockId id);
  /// Sets the value and covariance of a declared block, uncorrelated with the other blocks. The
  /// covariance is in the tangent; it is ignored for a constant block.
  void Add(BlockId id, const double* value, const ConstMatrix& covariance);
  /// Initialises the declared blocks `ids` with y = g(x, n), one after the other. `sources` are the
  /// blocks of x, disjoint from `ids`. With dy = J dx + J_n dn the covariance of y is
  /// J P_xx J' + noise_covariance, and its correlation with all other blocks is J P_x. J is
  /// row-major and has the columns of the sources' tangents side by side;
  /// noise_covariance = J_n Cov(n) J_n'.
  void Initialise(std::span<const BlockId> ids, const double* values,
                  std::span<const BlockId> sources, const Eigen::Ref<const RowMajor>& jacobian,
                  const ConstMatrix& noise_covariance);
  /// Removes a block. A block that is declared later may reuse its id. Values and covariance of the
  /// other blocks do not change.
  void Remove(BlockId id);
  /// Computes new_values: x_i (+) dx_i of all blocks with a covariance, unchanged values of the
  /// others. dx is indexed like the covariance. The state does not change (see MoveTo). Returns
  /// true if the new values are finite.
  bool Retract(const double* dx, std::vector<double>& new_values) const;
  /// Sets all values, without moving them in memory. Transports P if the tangent basis of a block
  /// changes with its value.
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
  std::vector<std::pair<int, int>> value_gaps_;  ///< (offset, size)
  Covariance covariance_;
  std::vector<BlockId> covariance_blocks_;  ///< blocks with rows of P, ascending
  bool is_flat_ = true;  ///< x (+) dx = x + dx: only vectors, with the same offsets in x and P
  Scratch<Workspace> memory_;
  // Output of FindRows.
  Scratch<std::vector<int>> rows_;     ///< of P
  Scratch<std::vector<int>> columns_;  ///< of a Jacobian with a column for each tangent element
};

/// Returns the Jacobian J (n x n, in `work`) of state.MoveTo(values): dx after it = J dx before it.
Workspace::Matrix TransportTo(const State& state, const std::vector<double>& values,
                              Workspace& work);

}  // namespace alidade
