// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "alidade/estimation/invariant_error.h"
#include "alidade/model/euclidean_group.h"

namespace alidade::internal {

/// Matrix of at most 9 x 9 elements, which does not allocate memory.
using GroupMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor,
                                  Se23::kTangent, Se23::kTangent>;
/// Column of at most 9 elements.
using GroupVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, Se23::kTangent, 1>;

/// M(X) = de/dxi and its inverse.
struct Maps {
  GroupMatrix blocks_from_group, group_from_blocks;
};

/// Group that the blocks of an InvariantError can form.
struct GroupInfo {
  std::vector<Geometry> blocks;
  const char* blocks_text;
  std::uint32_t left, right;  ///< geometries with the left and the right error
  Maps (*maps)(const double* x, ErrorSide side);
};

/// Returns all groups.
const std::vector<GroupInfo>& Groups();
/// Returns the group of the blocks, or null if their geometries are not those of a group.
const GroupInfo* FindGroup(const InvariantError& error, const Problem& problem);

/// Group element that replaces blocks of a problem.
class GroupBlock {
 public:
  GroupBlock(const InvariantError& error, const GroupInfo& info)
      : side_(error.side), info_(&info), ids_(error.blocks) {}

  Geometry geometry() const {
    return Geometry(side_ == ErrorSide::kLeft ? info_->left : info_->right);
  }
  /// Returns the index of a block of the problem in the group, or -1.
  int Find(BlockId id) const {
    const auto found = std::ranges::find(ids_, id);
    return found == ids_.end() ? -1 : static_cast<int>(found - ids_.begin());
  }
  const std::vector<BlockId>& ids() const { return ids_; }
  /// Returns the offset of a block in the values of the group.
  int ValueOffset(int index) const { return Offset(index, &Geometry::ambient); }
  /// Returns the first row of a block in M.
  int Row(int index) const { return Offset(index, &Geometry::tangent); }
  int Rows(int index) const { return info_->blocks[static_cast<std::size_t>(index)].tangent; }
  Maps MapsAt(const double* x) const { return info_->maps(x, side_); }

 private:
  int Offset(int index, int Geometry::*size) const {
    int offset = 0;
    for (int i = 0; i < index; ++i) offset += info_->blocks[static_cast<std::size_t>(i)].*size;
    return offset;
  }

  ErrorSide side_;
  const GroupInfo* info_;
  std::vector<BlockId> ids_;
};

}  // namespace alidade::internal
