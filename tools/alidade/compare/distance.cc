// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/distance.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "alidade/state/dense_algebra.h"

namespace alidade::internal {
namespace {

/// Block that both series contain, with the offsets of its elements in the rows.
struct SharedBlock {
  const SeriesBlock* block;
  int offset;                    ///< offset of the ambient elements in the series
  int reference_offset;          ///< offset of the ambient elements in the reference
  int reference_tangent_offset;  ///< offset of the tangent elements in the reference
  bool reference_is_constant;
};

/// Finds the blocks that both series contain, except blocks that are constant in both.
std::vector<SharedBlock> FindSharedBlocks(const Series& series, const Series& reference) {
  std::vector<SharedBlock> shared;
  int offset = 0;
  for (const SeriesBlock& block : series.blocks) {
    int reference_offset = 0, tangent_offset = 0;
    for (const SeriesBlock& candidate : reference.blocks) {
      const bool is_same = candidate.name == block.name && candidate.geometry == block.geometry;
      if (is_same && !(block.constant && candidate.constant)) {
        shared.push_back({&block, offset, reference_offset, tangent_offset, candidate.constant});
      }
      reference_offset += candidate.geometry.ambient;
      tangent_offset += candidate.geometry.tangent;
    }
    offset += block.geometry.ambient;
  }
  return shared;
}

/// Returns the pairs of rows with equal timestamps, in the order of the timestamps.
std::vector<std::pair<std::size_t, std::size_t>> SharedRows(const Series& a, const Series& b) {
  std::vector<std::pair<std::size_t, std::size_t>> rows;
  for (std::size_t i = 0, j = 0; i < a.timestamps.size() && j < b.timestamps.size();) {
    if (a.timestamps[i] == b.timestamps[j]) {
      rows.emplace_back(i++, j++);
    } else if (a.timestamps[i] < b.timestamps[j]) {
      ++i;
    } else {
      ++j;
    }
  }
  return rows;
}

const double* RowOf(const Series& series, std::size_t row, int offset) {
  return series.values.data() + row * static_cast<std::size_t>(series.ambient()) + offset;
}

/// Blocks of one owner, which have a joint covariance in the reference.
struct OwnerBlocks {
  std::string owner;
  std::vector<const SharedBlock*> blocks;
  double sum = 0.0;    ///< sum of d' P_ref^-1 d / dof
  double last = -1.0;  ///< sqrt(d' P_ref^-1 d / dof) at the last timestamp; -1: P_ref is singular
  std::int64_t count = 0;  ///< number of timestamps in the sum
};

std::vector<OwnerBlocks> GroupByOwner(const std::vector<SharedBlock>& shared) {
  std::vector<OwnerBlocks> groups;
  for (const SharedBlock& block : shared) {
    if (block.reference_is_constant) continue;
    const std::string owner = block.block->owner();
    auto group = std::ranges::find(groups, owner, &OwnerBlocks::owner);
    if (group == groups.end()) group = groups.insert(group, {owner, {}});
    group->blocks.push_back(&block);
  }
  return groups;
}

/// Returns P_ref of the blocks of one owner.
Eigen::MatrixXd CovarianceOf(const OwnerBlocks& group, const Series& reference, std::size_t row) {
  const Eigen::MatrixXd covariance = reference.Covariance(row, 0, reference.tangent());
  std::vector<int> elements;
  for (const SharedBlock* const block : group.blocks) {
    for (int i = 0; i < block->block->geometry.tangent; ++i) {
      elements.push_back(block->reference_tangent_offset + i);
    }
  }
  return covariance(elements, elements);
}

}  // namespace

Distance DistanceBetween(const Series& series, const Series& reference) {
  const std::vector<SharedBlock> shared = FindSharedBlocks(series, reference);
  std::vector<OwnerBlocks> groups = GroupByOwner(shared);
  std::map<std::string, std::pair<double, std::int64_t>> squares;
  Distance distance;
  std::map<const SharedBlock*, Eigen::VectorXd> d;
  for (const auto& [row, reference_row] : SharedRows(series, reference)) {
    for (const SharedBlock& block : shared) {
      const Geometry& geometry = block.block->geometry;
      const std::string& name = block.block->name;
      Eigen::VectorXd& error = d[&block];
      error.resize(geometry.tangent);
      geometry.Minus(RowOf(series, row, block.offset),
                     RowOf(reference, reference_row, block.reference_offset), error.data());
      if (!error.allFinite()) continue;
      squares[name].first += error.squaredNorm();
      ++squares[name].second;
      distance.final[name] = error.norm();
    }
    for (OwnerBlocks& group : groups) {
      const Eigen::MatrixXd p = CovarianceOf(group, reference, reference_row);
      Eigen::VectorXd error(p.rows());
      Eigen::Index offset = 0;
      for (const SharedBlock* const block : group.blocks) {
        error.segment(offset, d[block].size()) = d[block];
        offset += d[block].size();
      }
      const double square = SquaredMahalanobis(p, error);
      group.last =
          std::isnan(square) ? -1.0 : std::sqrt(square / static_cast<double>(error.size()));
      if (std::isnan(square)) continue;
      group.sum += square / static_cast<double>(error.size());
      ++group.count;
    }
  }
  for (const auto& [name, sum] : squares) {
    distance.rms[name] = std::sqrt(sum.first / static_cast<double>(sum.second));
  }
  for (const OwnerBlocks& group : groups) {
    if (group.count == 0) continue;
    distance.sigmas[group.owner] = std::sqrt(group.sum / static_cast<double>(group.count));
    if (group.last >= 0.0) distance.final_sigmas[group.owner] = group.last;
  }
  return distance;
}

std::optional<SimilarityFit> AlignTrajectories(const Series& series, const Series& reference,
                                               const std::string& block) {
  for (const SharedBlock& shared : FindSharedBlocks(series, reference)) {
    if (shared.block->name != block || shared.block->geometry != Geometry::Vector(3)) continue;
    TrajectoryAlignment alignment;
    for (const auto& [row, reference_row] : SharedRows(series, reference)) {
      const Eigen::Map<const Eigen::Vector3d> point(RowOf(series, row, shared.offset));
      const Eigen::Map<const Eigen::Vector3d> reference_point(
          RowOf(reference, reference_row, shared.reference_offset));
      if (point.allFinite() && reference_point.allFinite()) alignment.Add(point, reference_point);
    }
    return alignment.Result();
  }
  return std::nullopt;
}

}  // namespace alidade::internal
