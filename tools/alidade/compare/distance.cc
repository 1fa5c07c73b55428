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

/// A block that both series have: where it is in each, by ambient and tangent elements.
struct Shared {
  const SeriesBlock* block;
  int value, reference_value, reference_tangent;
  bool reference_constant;
};

/// Without those that are constant in both.
std::vector<Shared> SharedBlocks(const Series& series, const Series& reference) {
  std::vector<Shared> shared;
  int value = 0;
  for (const SeriesBlock& block : series.blocks) {
    int reference_value = 0, tangent = 0;
    for (const SeriesBlock& other : reference.blocks) {
      const bool same = other.name == block.name && other.geometry == block.geometry;
      if (same && !(block.constant && other.constant)) {
        shared.push_back({&block, value, reference_value, tangent, other.constant});
      }
      reference_value += other.geometry.ambient;
      tangent += other.geometry.tangent;
    }
    value += block.geometry.ambient;
  }
  return shared;
}

/// Rows of both series that have the same timestamp, in the order of time.
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

/// The blocks of one owner that the reference is uncertain of, jointly.
struct Joint {
  std::string owner;
  std::vector<const Shared*> blocks;
  double sum = 0.0, last = -1.0;
  std::int64_t count = 0;
};

std::vector<Joint> JointsOf(const std::vector<Shared>& shared) {
  std::vector<Joint> joints;
  for (const Shared& one : shared) {
    if (one.reference_constant) continue;
    const std::string owner = one.block->owner();
    auto joint = std::ranges::find(joints, owner, &Joint::owner);
    if (joint == joints.end()) joint = joints.insert(joint, {owner, {}});
    joint->blocks.push_back(&one);
  }
  return joints;
}

/// P of the reference of the blocks of a joint.
Eigen::MatrixXd CovarianceOf(const Joint& joint, const Series& reference, std::size_t row) {
  const Eigen::MatrixXd all = reference.Covariance(row, 0, reference.tangent());
  std::vector<int> elements;
  for (const Shared* const one : joint.blocks) {
    for (int i = 0; i < one->block->geometry.tangent; ++i) {
      elements.push_back(one->reference_tangent + i);
    }
  }
  return all(elements, elements);
}

}  // namespace

Distance DistanceBetween(const Series& series, const Series& reference) {
  const std::vector<Shared> shared = SharedBlocks(series, reference);
  std::vector<Joint> joints = JointsOf(shared);
  std::map<std::string, std::pair<double, std::int64_t>> squares;
  Distance distance;
  std::map<const Shared*, Eigen::VectorXd> d;
  for (const auto& [row, reference_row] : SharedRows(series, reference)) {
    for (const Shared& one : shared) {
      const Geometry& geometry = one.block->geometry;
      Eigen::VectorXd& error = d[&one];
      error.resize(geometry.tangent);
      geometry.Minus(RowOf(series, row, one.value),
                     RowOf(reference, reference_row, one.reference_value), error.data());
      if (!error.allFinite()) continue;
      squares[one.block->name].first += error.squaredNorm();
      ++squares[one.block->name].second;
      distance.final[one.block->name] = error.norm();
    }
    for (Joint& joint : joints) {
      const Eigen::MatrixXd p = CovarianceOf(joint, reference, reference_row);
      Eigen::VectorXd error(p.rows());
      Eigen::Index at = 0;
      for (const Shared* const one : joint.blocks) {
        error.segment(at, d[one].size()) = d[one];
        at += d[one].size();
      }
      const double square = SquaredMahalanobis(p, error);
      joint.last =
          std::isnan(square) ? -1.0 : std::sqrt(square / static_cast<double>(error.size()));
      if (std::isnan(square)) continue;
      joint.sum += square / static_cast<double>(error.size());
      ++joint.count;
    }
  }
  for (const auto& [name, sum] : squares) {
    distance.rms[name] = std::sqrt(sum.first / static_cast<double>(sum.second));
  }
  for (const Joint& joint : joints) {
    if (joint.count == 0) continue;
    distance.sigmas[joint.owner] = std::sqrt(joint.sum / static_cast<double>(joint.count));
    if (joint.last >= 0.0) distance.final_sigmas[joint.owner] = joint.last;
  }
  return distance;
}

std::optional<SimilarityFit> AlignTrajectories(const Series& series, const Series& reference,
                                               const std::string& block) {
  for (const Shared& one : SharedBlocks(series, reference)) {
    if (one.block->name != block || one.block->geometry != Geometry::Vector(3)) continue;
    TrajectoryAlignment alignment;
    for (const auto& [row, reference_row] : SharedRows(series, reference)) {
      const Eigen::Map<const Eigen::Vector3d> point(RowOf(series, row, one.value));
      const Eigen::Map<const Eigen::Vector3d> onto(
          RowOf(reference, reference_row, one.reference_value));
      if (point.allFinite() && onto.allFinite()) alignment.Add(point, onto);
    }
    return alignment.Result();
  }
  return std::nullopt;
}

}  // namespace alidade::internal
