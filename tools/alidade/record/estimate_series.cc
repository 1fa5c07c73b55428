// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/estimate_series.h"

#include <algorithm>
#include <cmath>

#include "alidade/estimation/estimator.h"

namespace alidade::internal {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

}  // namespace

std::vector<SeriesBlock> SeriesBlocksOf(const Problem& problem) {
  std::vector<SeriesBlock> blocks;
  for (BlockId id = 0; id < static_cast<int>(problem.layout.blocks().size()); ++id) {
    const Block& block = problem.layout[id];
    blocks.push_back({block.name, UnitOf(problem, id), block.geometry(),
                      block.status == BlockStatus::kConstant});
  }
  return blocks;
}

void AppendCovariance(const State& state, std::size_t blocks, std::vector<double>& cells) {
  std::vector<int> indices;  // index of each tangent element in P; -1: no covariance
  for (std::size_t b = 0; b < blocks; ++b) {
    const Block& block = state.layout()[static_cast<BlockId>(b)];
    for (int i = 0; i < block.geometry().tangent; ++i) {
      indices.push_back(block.has_covariance() ? block.tangent_offset + i : -1);
    }
  }
  for (std::size_t i = 0; i < indices.size(); ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      const bool has_covariance = indices[i] >= 0 && indices[j] >= 0;
      cells.push_back(has_covariance ? state.covariance().Block(indices[i], 1, indices[j], 1)(0, 0)
                                     : kNan);
    }
  }
}

int Series::ambient() const {
  int sum = 0;
  for (const SeriesBlock& block : blocks) sum += block.geometry.ambient;
  return sum;
}

int Series::tangent() const {
  int sum = 0;
  for (const SeriesBlock& block : blocks) sum += block.geometry.tangent;
  return sum;
}

std::size_t Series::cells() const {
  const auto n = static_cast<std::size_t>(tangent());
  return joint ? n * (n + 1) / 2 : n;
}

Eigen::MatrixXd Series::Covariance(std::size_t row, int first, int size) const {
  Eigen::MatrixXd p = Eigen::MatrixXd::Zero(size, size);
  const double* const row_cells = covariances.data() + row * cells();
  for (int i = 0; i < size; ++i) {
    const int a = first + i;
    if (!joint) p(i, i) = row_cells[a];
    for (int j = 0; joint && j <= i; ++j)
      p(i, j) = p(j, i) = row_cells[a * (a + 1) / 2 + first + j];
  }
  return p;
}

void Series::Append(Timestamp timestamp, const State& state) {
  timestamps.push_back(timestamp);
  for (BlockId id = 0; id < static_cast<int>(blocks.size()); ++id) {
    const Block& block = state.layout()[id];
    const auto size = static_cast<std::size_t>(block.geometry().ambient);
    if (block.present) {
      values.insert(values.end(), state.value(id), state.value(id) + size);
    } else {
      values.insert(values.end(), size, kNan);
    }
    for (int i = 0; !joint && i < block.geometry().tangent; ++i) {
      const bool has_covariance = block.has_covariance();
      covariances.push_back(has_covariance ? state.covariance().Variance(block.tangent_offset + i)
                                           : kNan);
    }
  }
  if (joint) AppendCovariance(state, blocks.size(), covariances);
}

}  // namespace alidade::internal
