// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/state.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "alidade/base/all_finite.h"
#include "alidade/base/error.h"
#include "alidade/state/projection.h"

namespace alidade {
namespace {

/// The offset of `size` numbers of `values`, in a gap of that size or at the end.
int TakeValues(std::vector<double>& values, std::vector<std::pair<int, int>>& gaps, int size) {
  const auto gap = std::ranges::find(gaps, size, &std::pair<int, int>::second);
  if (gap == gaps.end()) {
    values.resize(values.size() + static_cast<std::size_t>(size));
    return static_cast<int>(values.size()) - size;
  }
  const int offset = gap->first;
  gaps.erase(gap);
  return offset;
}

}  // namespace

BlockId StateLayout::Declare(std::string_view name, std::string_view owner, const Space& space,
                             BlockStatus status) {
  ALIDADE_EXPECTS(Find(name) < 0);
  if (dropped_.empty()) {
    Block fresh;  // before blocks_ moves: the arguments may lie in it
    fresh.name = name;
    fresh.owner = owner;
    fresh.space = space;
    fresh.status = status;
    blocks_.push_back(std::move(fresh));
    return static_cast<BlockId>(blocks_.size()) - 1;
  }
  // One of the same kind has memory for all that is assigned.
  const auto same = [&](BlockId id) { return (*this)[id].space.name == space.name; };
  auto place = std::ranges::find_if(dropped_, same);
  if (place == dropped_.end()) --place;
  const BlockId id = *place;
  dropped_.erase(place);
  Block& block = blocks_[static_cast<std::size_t>(id)];
  block.name = name;
  block.owner = owner;
  block.space = space;
  block.status = status;
  return id;
}

void StateLayout::Drop(BlockId id) {
  (*this)[id].present = false;
  (*this)[id].name.clear();  // what is assigned to it next has its memory
  dropped_.push_back(id);
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

BlockEstimate State::Estimate(BlockId id) const {
  ALIDADE_EXPECTS(id >= 0 && id < std::ssize(layout_.blocks()));
  const Block& block = layout_[id];
  if (!block.present) throw ContractViolation("block '" + block.name + "' has no value yet");
  BlockEstimate estimate{Eigen::Map<const Eigen::VectorXd>(value(id), block.geometry().ambient),
                         Eigen::VectorXd(block.geometry().tangent)};
  for (int i = 0; i < block.geometry().tangent; ++i) estimate.sigma[i] = sigma(id, i);
  return estimate;
}

void State::Reserve(BlockId id) {
  Block& block = layout_[id];
  if (block.value_offset >= 0) return;
  block.value_offset = TakeValues(values_, value_gaps_, block.geometry().ambient);
  if (block.status == BlockStatus::kConstant) {
    flat_ = false;
    return;
  }
  block.tangent_offset = covariance_.Add(block.geometry().tangent);
  flat_ = flat_ && block.geometry().kind == GeometryKind::kVector &&
          block.value_offset == block.tangent_offset;
  placed_.insert(std::ranges::lower_bound(placed_, id), id);
}

void State::PlaceValue(BlockId id, const double* value) {
  Reserve(id);
  Block& block = layout_[id];
  block.present = true;
  std::copy_n(value, block.geometry().ambient, values_.data() + block.value_offset);
}

void State::Add(BlockId id, const double* value, const ConstMatrix& covariance) {
  PlaceValue(id, value);
  const Block& block = layout_[id];
  if (block.status == BlockStatus::kConstant) return;
  ALIDADE_EXPECTS(covariance.rows() == block.geometry().tangent);
  covariance_.SetRows(block.tangent_offset, covariance);
}

void State::Initialise(std::span<const BlockId> ids, const double* values,
                       std::span<const BlockId> from, const Eigen::Ref<const RowMajor>& jacobian,
                       const ConstMatrix& own) {
  for (const BlockId id : ids) {
    PlaceValue(id, values);
    values += layout_[id].geometry().ambient;
  }
  ALIDADE_EXPECTS(jacobian.cols() == FindRows(from));
  const Workspace::Use use(memory_);
  const Eigen::Index count = jacobian.rows(), width = std::ssize(columns_);
  Workspace::Matrix cross = memory_.Take(covariance_.size(), count), p = memory_.Take(count, count);
  Eigen::Map<RowMajor> present(memory_.Take(count * width).data(), count, width);
  for (Eigen::Index c = 0; c < width; ++c) {
    present.col(c) = jacobian.col(columns_[static_cast<std::size_t>(c)]);
  }
  p.setZero();
  Project(covariance_, {present.data(), static_cast<int>(count), rows_}, cross.data(), p.data());
  p += own;
  ALIDADE_EXPECTS(FindRows(ids) == std::ssize(rows_));
  covariance_.SetRows(rows_, p, cross);
}

/// Fills rows_ and columns_, and returns the size of the blocks' tangents.
int State::FindRows(std::span<const BlockId> blocks) {
  rows_.clear();
  columns_.clear();
  int column = 0;
  for (const BlockId id : blocks) {
    const Block& block = layout_[id];
    for (int k = 0; k < block.geometry().tangent; ++k, ++column) {
      if (!block.has_covariance()) continue;
      rows_.push_back(block.tangent_offset + k);
      columns_.push_back(column);
    }
  }
  return column;
}

/// Gives the place of a block back.
void State::Release(BlockId id) {
  Block& block = layout_[id];
  value_gaps_.emplace_back(block.value_offset, block.geometry().ambient);
  if (block.tangent_offset >= 0) {
    covariance_.Release(block.tangent_offset, block.geometry().tangent);
    placed_.erase(std::ranges::lower_bound(placed_, id));
  }
  block.present = false;
  block.value_offset = block.tangent_offset = -1;
  FillGaps();
}

/// Moves the last block into a gap, as long as one holds it.
void State::FillGaps() {
  for (;;) {
    const auto found = std::ranges::max_element(
        placed_, {}, [&](BlockId id) { return layout_[id].tangent_offset; });
    if (found == placed_.end()) return;
    Block& last = layout_[*found];
    const int rows = last.geometry().tangent;
    const int gap = covariance_.MoveToGap(last.tangent_offset, rows);
    if (gap < 0) return;
    last.tangent_offset = gap;
    flat_ = false;
  }
}

void State::Drop(BlockId id) {
  if (layout_[id].value_offset >= 0) Release(id);
  layout_.Drop(id);
}

bool State::Retract(const double* dx, std::vector<double>& moved) const {
  moved.resize(values_.size());
  if (!flat_) return RetractBlocks(dx, moved);
  const double* const from = values_.data();
  double* const to = moved.data();
  const std::size_t n = static_cast<std::size_t>(covariance_.size()), all = moved.size();
  double defect = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    to[i] = from[i] + dx[i];
    defect += 0.0 * to[i];
  }
  for (std::size_t i = n; i < all; ++i) to[i] = from[i];
  return defect == 0.0;
}

/// Retract block by block.
bool State::RetractBlocks(const double* dx, std::vector<double>& moved) const {
  std::ranges::copy(values_, moved.begin());
  for (const BlockId id : placed_) {
    const Block& block = layout_[id];
    if (!block.present) continue;
    double* x = moved.data() + block.value_offset;
    block.geometry().Plus(x, dx + block.tangent_offset, x);
  }
  return internal::AllFinite(moved);
}

void State::MoveTo(const std::vector<double>& values) {
  ALIDADE_EXPECTS(values.size() == values_.size());
  if (!flat_) TurnTangents(values);
  for (std::size_t i = 0, n = values.size(); i < n; ++i) values_[i] = values[i];
}

/// P where the tangent basis of a block turns on the way to those values.
void State::TurnTangents(const std::vector<double>& values) {
  for (const BlockId id : placed_) {
    const Block& block = layout_[id];
    if (!block.present || block.geometry().kind != GeometryKind::kUnitVector) continue;
    std::array<double, 4> j;  // a unit vector's tangent has two elements
    block.geometry().Transport(values_.data() + block.value_offset,
                               values.data() + block.value_offset, j.data());
    const std::array rows{block.tangent_offset, block.tangent_offset + 1};
    covariance_.Propagate(rows, j.data());
  }
}

Workspace::Matrix TransportTo(const State& state, const std::vector<double>& values,
                              Workspace& work) {
  const int n = state.covariance().size();
  Workspace::Matrix transport = work.Take(n, n);
  transport.setIdentity();
  for (const Block& block : state.layout().blocks()) {
    if (!block.has_covariance() || block.geometry().kind != GeometryKind::kUnitVector) continue;
    Eigen::Matrix<double, 2, 2, Eigen::RowMajor> j;
    block.geometry().Transport(state.values().data() + block.value_offset,
                               values.data() + block.value_offset, j.data());
    transport.block<2, 2>(block.tangent_offset, block.tangent_offset) = j;
  }
  return transport;
}

}  // namespace alidade
