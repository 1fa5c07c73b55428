// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/state.h"

#include <algorithm>
#include <cmath>

#include "alidade/base/error.h"

namespace alidade {

BlockId StateLayout::Declare(std::string name, std::string owner, Space space, BlockStatus status) {
  ALIDADE_EXPECTS(Find(name) < 0);
  Block block;
  block.name = std::move(name);
  block.owner = std::move(owner);
  block.space = std::move(space);
  block.status = status;
  if (!dropped_.empty()) {
    const BlockId id = dropped_.back();
    dropped_.pop_back();
    blocks_[static_cast<std::size_t>(id)] = std::move(block);
    return id;
  }
  blocks_.push_back(std::move(block));
  return static_cast<BlockId>(blocks_.size()) - 1;
}

BlockId StateLayout::Find(std::string_view name) const {
  const auto found = std::find_if(blocks_.begin(), blocks_.end(),
                                  [name](const Block& b) { return b.name == name; });
  return found == blocks_.end() ? -1 : static_cast<BlockId>(found - blocks_.begin());
}

double State::sigma(BlockId id, int i) const {
  const Block& block = layout_[id];
  ALIDADE_EXPECTS(block.present && i >= 0 && i < block.geometry().tangent);
  if (!block.has_covariance()) return 0.0;
  return std::sqrt(covariance_.Variance(block.tangent_offset + i));
}

BlockId State::Declare(std::string name, std::string owner, Space space, BlockStatus status) {
  return layout_.Declare(std::move(name), std::move(owner), std::move(space), status);
}

void State::Reserve(BlockId id) {
  Block& block = layout_.blocks_[static_cast<std::size_t>(id)];
  if (block.value_offset >= 0) return;
  const int size = block.geometry().ambient;
  const auto gap = std::find_if(value_gaps_.begin(), value_gaps_.end(),
                                [size](const auto& g) { return g.second == size; });
  if (gap != value_gaps_.end()) {
    block.value_offset = gap->first;
    value_gaps_.erase(gap);
  } else {
    block.value_offset = static_cast<int>(values_.size());
    values_.resize(values_.size() + static_cast<std::size_t>(size));
  }
  if (block.status == BlockStatus::kConstant) return;
  block.tangent_offset = covariance_.Add(block.geometry().tangent);
}

void State::PlaceValue(BlockId id, const double* value) {
  Reserve(id);
  Block& block = layout_.blocks_[static_cast<std::size_t>(id)];
  block.present = true;
  std::copy_n(value, block.geometry().ambient, this->value(id));
}

void State::Add(BlockId id, const double* value, const Eigen::MatrixXd& covariance) {
  PlaceValue(id, value);
  const Block& block = layout_[id];
  if (block.status == BlockStatus::kConstant) return;
  ALIDADE_EXPECTS(covariance.rows() == block.geometry().tangent);
  covariance_.SetRows(block.tangent_offset, covariance,
                      Eigen::MatrixXd::Zero(covariance_.size(), covariance.rows()));
}

void State::Initialise(BlockId id, const double* value, const std::vector<BlockId>& from,
                       const std::vector<Eigen::MatrixXd>& jacobians, const Eigen::MatrixXd& own) {
  ALIDADE_EXPECTS(from.size() == jacobians.size());
  PlaceValue(id, value);
  const Block& block = layout_[id];
  if (block.status == BlockStatus::kConstant) return;
  const int rows = block.geometry().tangent;
  std::vector<JacobianBlock> j;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Block& source = layout_[from[i]];
    const bool counts = source.has_covariance() && from[i] != id;
    if (counts) j.push_back({source.tangent_offset, jacobians[i]});
  }
  const Eigen::MatrixXd cross = covariance_.TimesTransposed(j, rows);
  covariance_.SetRows(block.tangent_offset, Times(j, rows, cross) + own, cross);
}

void State::Initialise(const std::vector<BlockId>& ids, const double* values,
                       const std::vector<BlockId>& from,
                       const std::vector<Eigen::MatrixXd>& jacobians, const Eigen::MatrixXd& own) {
  ALIDADE_EXPECTS(from.size() == jacobians.size());
  Eigen::Index row = 0;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const Geometry geometry = layout_[ids[i]].geometry();
    const Eigen::Index k = geometry.tangent;
    std::vector<Eigen::MatrixXd> rows;
    for (const Eigen::MatrixXd& j : jacobians) rows.emplace_back(j.middleRows(row, k));
    Initialise(ids[i], values, from, rows, own.block(row, row, k, k));
    values += geometry.ambient;
    const Block& block = layout_[ids[i]];
    Eigen::Index column = 0;
    for (std::size_t j = 0; j < i; ++j) {
      const Block& other = layout_[ids[j]];
      const int size = other.geometry().tangent;
      if (block.has_covariance() && other.has_covariance()) {
        const Eigen::MatrixXd through_x = covariance_.Block(
            block.tangent_offset, block.geometry().tangent, other.tangent_offset, size);
        covariance_.SetBlock(block.tangent_offset, other.tangent_offset,
                             through_x + own.block(row, column, k, size));
      }
      column += size;
    }
    row += k;
  }
}

BlockId State::Clone(BlockId source, std::string name) {
  const Block original = layout_[source];
  ALIDADE_EXPECTS(original.present);
  const BlockId id = Declare(std::move(name), original.owner, original.space, original.status);
  const std::vector<double> copy(value(source), value(source) + original.geometry().ambient);
  const int n = original.geometry().tangent;
  Initialise(id, copy.data(), {source}, {Eigen::MatrixXd::Identity(n, n)},
             Eigen::MatrixXd::Zero(n, n));
  return id;
}

void State::Marginalise(BlockId id) {
  ALIDADE_EXPECTS(layout_[id].present);
  Release(id);
}

/// Gives the place of a block back.
void State::Release(BlockId id) {
  Block& block = layout_.blocks_[static_cast<std::size_t>(id)];
  value_gaps_.emplace_back(block.value_offset, block.geometry().ambient);
  if (block.tangent_offset >= 0) {
    covariance_.Release(block.tangent_offset, block.geometry().tangent);
  }
  block.present = false;
  block.value_offset = block.tangent_offset = -1;
  FillGaps();
}

/// Moves the last block into a gap, as long as one holds it.
void State::FillGaps() {
  for (;;) {
    const auto last = std::max_element(
        layout_.blocks_.begin(), layout_.blocks_.end(),
        [](const Block& a, const Block& b) { return a.tangent_offset < b.tangent_offset; });
    if (last == layout_.blocks_.end() || last->tangent_offset < 0) return;
    const int rows = last->geometry().tangent;
    const int gap = covariance_.FindGap(rows);
    if (gap < 0) return;
    covariance_.Move(last->tangent_offset, gap, rows);
    last->tangent_offset = gap;
  }
}

void State::Drop(BlockId id) {
  if (layout_[id].value_offset >= 0) Release(id);
  layout_.blocks_[static_cast<std::size_t>(id)] = {};
  layout_.dropped_.push_back(id);
}

void State::Reparametrise(BlockId id, Space space, const double* value,
                          const Eigen::MatrixXd& jacobian) {
  const Block old = layout_[id];
  ALIDADE_EXPECTS(old.present);
  const BlockId fresh = Declare(old.name + "'", old.owner, std::move(space), old.status);
  const Eigen::Index n = jacobian.rows();
  Initialise(fresh, value, {id}, {jacobian}, Eigen::MatrixXd::Zero(n, n));
  Marginalise(id);
  Block& block = layout_.blocks_[static_cast<std::size_t>(id)];
  block = layout_[fresh];
  block.name = old.name;
  layout_.blocks_[static_cast<std::size_t>(fresh)] = {};
  layout_.dropped_.push_back(fresh);
}

void State::Retract(const double* dx, std::vector<double>& moved) const {
  moved.assign(values_.begin(), values_.end());
  for (const Block& block : layout_.blocks()) {
    if (!block.has_covariance()) continue;
    double* x = moved.data() + block.value_offset;
    block.geometry().Plus(x, dx + block.tangent_offset, x);
  }
}

void State::MoveTo(const std::vector<double>& values) {
  ALIDADE_EXPECTS(values.size() == values_.size());
  for (const Block& block : layout_.blocks()) {
    if (!block.has_covariance() || block.geometry().kind != GeometryKind::kUnitVector) continue;
    RowMajor j(block.geometry().tangent, block.geometry().tangent);
    block.geometry().Transport(values_.data() + block.value_offset,
                               values.data() + block.value_offset, j.data());
    covariance_.Transform(block.tangent_offset, j);
  }
  std::copy(values.begin(), values.end(), values_.begin());
}

}  // namespace alidade
