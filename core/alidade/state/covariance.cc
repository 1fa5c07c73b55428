// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/covariance.h"

#include <algorithm>
#include <numeric>

#include "alidade/state/kernels.h"

namespace alidade {

int Covariance::Add(int rows) {
  if (const int gap = UseGap(rows); gap >= 0) return gap;
  const int offset = size_;
  Reserve(rows);
  size_ += rows;
  return offset;
}

void Covariance::Reserve(int rows) {
  const int needed = size_ + rows;
  if (needed <= capacity_) return;
  // Reserves an eighth more than requested, because the state contains two representations of a
  // landmark during its conversion.
  const int capacity = internal::PaddedSize(std::max(2 * capacity_, needed + needed / 8));
  const auto side = static_cast<std::size_t>(capacity);
  AlignedNumbers larger(side * side, 0.0);
  Eigen::Map<Eigen::MatrixXd>(larger.data(), capacity, capacity).topLeftCorner(size_, size_) =
      p().topLeftCorner(size_, size_);
  p_.swap(larger);
  capacity_ = capacity;
}

/// Removes `rows` rows from the smallest gap that is large enough. Returns their offset. Returns -1
/// if no gap is large enough.
int Covariance::UseGap(int rows) {
  auto smallest_gap = gaps_.end();
  for (auto gap = gaps_.begin(); gap != gaps_.end(); ++gap) {
    if (gap->second < rows) continue;
    if (smallest_gap == gaps_.end() || gap->second < smallest_gap->second) smallest_gap = gap;
  }
  if (smallest_gap == gaps_.end()) return -1;
  const auto [offset, size] = *smallest_gap;
  gaps_.erase(smallest_gap);
  if (rows < size) gaps_.emplace_back(offset + rows, size - rows);
  return offset;
}

void Covariance::Clear(int offset, int rows) {
  p().block(offset, 0, rows, offset).setZero();
  p().block(offset, offset, size_ - offset, rows).setZero();
}

void Covariance::Release(int offset, int rows) {
  Clear(offset, rows);
  // Merges the new gap with adjacent gaps. Removes a gap at the end.
  for (auto gap = gaps_.begin(); gap != gaps_.end();) {
    const bool is_before = gap->first + gap->second == offset;
    const bool is_after = offset + rows == gap->first;
    if (!is_before && !is_after) {
      ++gap;
      continue;
    }
    offset = std::min(offset, gap->first);
    rows += gap->second;
    gap = gaps_.erase(gap);
  }
  if (offset + rows == size_) {
    size_ = offset;
  } else {
    gaps_.emplace_back(offset, rows);
  }
}

int Covariance::MoveToGap(int offset, int rows) {
  const int new_offset = UseGap(rows);
  if (new_offset < 0) return new_offset;
  const Workspace::Use use(memory_);
  Workspace::Matrix cross = memory_.Take(size_, rows);
  cross.topRows(offset) = p().block(offset, 0, rows, offset).transpose();
  cross.bottomRows(size_ - offset) = p().block(offset, offset, size_ - offset, rows);
  moved_rows_.resize(static_cast<std::size_t>(rows));
  std::iota(moved_rows_.begin(), moved_rows_.end(), new_offset);
  SetRows(moved_rows_, cross.middleRows(offset, rows), cross);
  Release(offset, rows);
  return new_offset;
}

Eigen::MatrixXd Covariance::Block(int a, int rows, int b, int columns) const {
  if (a == b) return p().block(a, a, rows, rows).selfadjointView<Eigen::Lower>();
  if (a > b) return p().block(a, b, rows, columns);
  return p().block(b, a, columns, rows).transpose();
}

void Covariance::SetBlock(int a, int b, const ConstMatrix& value) {
  if (a == b) {
    p().block(a, a, value.rows(), value.rows()).triangularView<Eigen::Lower>() = value;
  } else if (a > b) {
    p().block(a, b, value.rows(), value.cols()) = value;
  } else {
    p().block(b, a, value.cols(), value.rows()) = value.transpose();
  }
}

void Covariance::SetRows(int offset, const ConstMatrix& diagonal_block) {
  Clear(offset, static_cast<int>(diagonal_block.rows()));
  SetBlock(offset, offset, diagonal_block);
}

void Covariance::SetRows(std::span<const int> rows, const ConstMatrix& diagonal_block,
                         const ConstMatrix& cross) {
  auto p = this->p();
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const Eigen::Index row = rows[k], height = size_ - row;
    const auto column = cross.col(static_cast<Eigen::Index>(k));
    p.row(row).head(row) = column.head(row).transpose();
    p.col(row).segment(row, height) = column.tail(height);
  }
  // Overwrites the elements of `cross` that were copied to the diagonal block.
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      p(std::max(rows[i], rows[j]), std::min(rows[i], rows[j])) =
          diagonal_block(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
  }
}

internal::SymmetricView Covariance::view() { return {p_.data(), size_, capacity_}; }

bool Covariance::Propagate(std::span<const int> rows, const double* f, const double* noise,
                           int width, const double* cross) {
  const internal::SymmetricView p = view();
  const std::size_t needed =
      internal::Transition::MemoryOf(size_, static_cast<int>(rows.size()), width);
  if (step_memory_.size() < needed) step_memory_.resize(needed);
  return internal::KernelsFor(p).propagate(p, {rows, f, noise, width, cross, step_memory_.data()});
}

Eigen::MatrixXd Covariance::Dense() const {
  return p().topLeftCorner(size_, size_).selfadjointView<Eigen::Lower>();
}

}  // namespace alidade
