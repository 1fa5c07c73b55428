// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/state.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>

#include "alidade/base/all_finite.h"
#include "alidade/base/error.h"
#include "alidade/state/projection.h"

namespace alidade {
namespace {

/// Reserves `size` numbers in `values`, in a gap of exactly that size or at the end. Returns their
/// offset.
int AllocateValues(std::vector<double>& values, std::vector<std::pair<int, int>>& gaps, int size) {
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
  if (removed_.empty()) {
    // Creates a complete block first, because the arguments may refer to elements of blocks_.
    Block new_block;
    new_block.name = name;
    new_block.owner = owner;
    new_block.space = space;
    new_block.status = status;
    blocks_.push_back(std::move(new_block));
    return static_cast<BlockId>(blocks_.size()) - 1;
  }
  // The strings of a removed block with the same space have enough memory for the assignments
  // below.
  const auto has_same_space = [&](BlockId id) { return (*this)[id].space.name == space.name; };
  auto position = std::ranges::find_if(removed_, has_same_space);
  if (position == removed_.end()) --position;
  const BlockId id = *position;
  removed_.erase(position);
  Block& block = blocks_[static_cast<std::size_t>(id)];
  block.name = name;
  block.owner = owner;
  block.space = space;
  block.status = status;
  return id;
}

void StateLayout::Remove(BlockId id) {
  (*this)[id].present = false;
  (*this)[id].name.clear();  // retains the memory for the next assignment
  removed_.push_back(id);
}

BlockId StateLayout::Find(std::string_view name) const {
  const auto block = std::find_if(blocks_.begin(), blocks_.end(),
                                  [name](const Block& b) { return b.name == name; });
  return block == blocks_.end() ? -1 : static_cast<BlockId>(block - blocks_.begin());
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
  block.value_offset = AllocateValues(values_, value_gaps_, block.geometry().ambient);
  if (block.status == BlockStatus::kConstant) {
    is_flat_ = false;
    return;
  }
  block.tangent_offset = covariance_.Add(block.geometry().tangent);
  is_flat_ = is_flat_ && block.geometry().is_vector() && block.value_offset == block.tangent_offset;
  covariance_blocks_.insert(std::ranges::lower_bound(covariance_blocks_, id), id);
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
                       std::span<const BlockId> sources, const Eigen::Ref<const RowMajor>& jacobian,
                       const ConstMatrix& noise_covariance) {
  for (const BlockId id : ids) {
    PlaceValue(id, values);
    values += layout_[id].geometry().ambient;
  }
  ALIDADE_EXPECTS(jacobian.cols() == FindRows(sources));
  const Workspace::Use use(memory_);
  const Eigen::Index count = jacobian.rows(), width = std::ssize(columns_);
  Workspace::Matrix cross = memory_.Take(covariance_.size(), count), p = memory_.Take(count, count);
  Eigen::Map<RowMajor> used_columns(memory_.Take(count * width).data(), count, width);
  for (Eigen::Index c = 0; c < width; ++c) {
    used_columns.col(c) = jacobian.col(columns_[static_cast<std::size_t>(c)]);
  }
  p.setZero();
  Project(covariance_, {used_columns.data(), static_cast<int>(count), rows_}, cross.data(),
          p.data());
  p += noise_covariance;
  ALIDADE_EXPECTS(FindRows(ids) == std::ssize(rows_));
  covariance_.SetRows(rows_, p, cross);
}

/// Sets rows_ and columns_ to the rows and columns of the blocks. Returns the total tangent size of
/// the blocks.
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

/// Releases the memory of a block.
void State::Release(BlockId id) {
  Block& block = layout_[id];
  value_gaps_.emplace_back(block.value_offset, block.geometry().ambient);
  if (block.tangent_offset >= 0) {
    covariance_.Release(block.tangent_offset, block.geometry().tangent);
    covariance_blocks_.erase(std::ranges::lower_bound(covariance_blocks_, id));
  }
  block.present = false;
  block.value_offset = block.tangent_offset = -1;
  FillGaps();
}

/// Moves the last block of P into a gap. Repeats this until no gap is large enough for the last
/// block.
void State::FillGaps() {
  for (;;) {
    const auto last_id = std::ranges::max_element(
        covariance_blocks_, {}, [&](BlockId id) { return layout_[id].tangent_offset; });
    if (last_id == covariance_blocks_.end()) return;
    Block& last = layout_[*last_id];
    const int rows = last.geometry().tangent;
    const int gap = covariance_.MoveToGap(last.tangent_offset, rows);
    if (gap < 0) return;
    last.tangent_offset = gap;
    is_flat_ = false;
  }
}

void State::Remove(BlockId id) {
  if (layout_[id].value_offset >= 0) Release(id);
  layout_.Remove(id);
}

bool State::Retract(const double* dx, std::vector<double>& new_values) const {
  new_values.resize(values_.size());
  if (!is_flat_) return RetractBlocks(dx, new_values);
  const double* const source = values_.data();
  double* const destination = new_values.data();
  const std::size_t n = static_cast<std::size_t>(covariance_.size()), size = new_values.size();
  double defect = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    destination[i] = source[i] + dx[i];
    defect += 0.0 * destination[i];
  }
  for (std::size_t i = n; i < size; ++i) destination[i] = source[i];
  return defect == 0.0;
}

/// Computes the result of Retract() block by block.
bool State::RetractBlocks(const double* dx, std::vector<double>& new_values) const {
  std::ranges::copy(values_, new_values.begin());
  for (const BlockId id : covariance_blocks_) {
    const Block& block = layout_[id];
    if (!block.present) continue;
    double* x = new_values.data() + block.value_offset;
    block.geometry().Plus(x, dx + block.tangent_offset, x);
  }
  return internal::AllFinite(new_values);
}

void State::MoveTo(const std::vector<double>& values) {
  ALIDADE_EXPECTS(values.size() == values_.size());
  if (!is_flat_) TransportCovariance(values);
  for (std::size_t i = 0, n = values.size(); i < n; ++i) values_[i] = values[i];
}

/// Transports P for the blocks whose tangent basis changes with their value.
void State::TransportCovariance(const std::vector<double>& values) {
  for (const BlockId id : covariance_blocks_) {
    const Block& block = layout_[id];
    if (!block.present || !block.geometry().has_transport()) continue;
    constexpr auto kMost = static_cast<std::size_t>(detail::kMaxTangent);
    std::array<double, kMost * kMost> j;
    std::array<int, kMost> rows;
    block.geometry().Transport(values_.data() + block.value_offset,
                               values.data() + block.value_offset, j.data());
    std::iota(rows.begin(), rows.end(), block.tangent_offset);
    covariance_.Propagate(std::span(rows).first(static_cast<std::size_t>(block.geometry().tangent)),
                          j.data());
  }
}

void TransportRows(const State& state, const std::vector<double>& values,
                   Eigen::Ref<Eigen::MatrixXd> a) {
  for (const Block& block : state.layout().blocks()) {
    if (!block.has_covariance() || !block.geometry().has_transport()) continue;
    const int size = block.geometry().tangent;
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, detail::kMaxTangent,
                  detail::kMaxTangent>
        j(size, size);
    Eigen::Matrix<double, Eigen::Dynamic, 1, 0, detail::kMaxTangent> moved(size);
    block.geometry().Transport(state.values().data() + block.value_offset,
                               values.data() + block.value_offset, j.data());
    for (Eigen::Index column = 0; column < a.cols(); ++column) {
      moved = j.lazyProduct(a.col(column).segment(block.tangent_offset, size));
      a.col(column).segment(block.tangent_offset, size) = moved;
    }
  }
}

}  // namespace alidade
