// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/covariance.h"

#include <algorithm>
#include <numeric>

#include "alidade/state/kernels.h"

namespace alidade {

int Covariance::Add(int rows) {
  if (const int gap = TakeGap(rows); gap >= 0) return gap;
  const int offset = size_;
  Reserve(rows);
  size_ += rows;
  return offset;
}

void Covariance::Reserve(int rows) {
  const int needed = size_ + rows;
  if (needed <= capacity_) return;
  // An eighth more than asked for: a landmark that takes another form is there twice for a while.
  const int capacity = internal::PaddedSize(std::max(2 * capacity_, needed + needed / 8));
  const auto side = static_cast<std::size_t>(capacity);
  AlignedNumbers larger(side * side, 0.0);
  Eigen::Map<Eigen::MatrixXd>(larger.data(), capacity, capacity).topLeftCorner(size_, size_) =
      p().topLeftCorner(size_, size_);
  p_.swap(larger);
  capacity_ = capacity;
}

/// Takes `rows` rows from the smallest gap that has them, and returns their offset; -1: none has.
int Covariance::TakeGap(int rows) {
  auto best = gaps_.end();
  for (auto gap = gaps_.begin(); gap != gaps_.end(); ++gap) {
    if (gap->second < rows) continue;
    if (best == gaps_.end() || gap->second < best->second) best = gap;
  }
  if (best == gaps_.end()) return -1;
  const auto [offset, size] = *best;
  gaps_.erase(best);
  if (rows < size) gaps_.emplace_back(offset + rows, size - rows);
  return offset;
}

void Covariance::Clear(int offset, int rows) {
  p().block(offset, 0, rows, offset).setZero();
  p().block(offset, offset, size_ - offset, rows).setZero();
}

void Covariance::Release(int offset, int rows) {
  Clear(offset, rows);
  // Gaps that touch become one, and one at the end is given back.
  for (auto gap = gaps_.begin(); gap != gaps_.end();) {
    const bool before = gap->first + gap->second == offset, after = offset + rows == gap->first;
    if (!before && !after) {
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

int Covariance::MoveToGap(int from, int rows) {
  const int to = TakeGap(rows);
  if (to < 0) return to;
  const Workspace::Use use(memory_);
  Workspace::Matrix cross = memory_.Take(size_, rows);
  cross.topRows(from) = p().block(from, 0, rows, from).transpose();
  cross.bottomRows(size_ - from) = p().block(from, from, size_ - from, rows);
  moved_.resize(static_cast<std::size_t>(rows));
  std::iota(moved_.begin(), moved_.end(), to);
  SetRows(moved_, cross.middleRows(from, rows), cross);
  Release(from, rows);
  return to;
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

void Covariance::SetRows(int offset, const ConstMatrix& own) {
  Clear(offset, static_cast<int>(own.rows()));
  SetBlock(offset, offset, own);
}

void Covariance::SetRows(std::span<const int> rows, const ConstMatrix& own,
                         const ConstMatrix& cross) {
  auto p = this->p();
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const Eigen::Index row = rows[k], below = size_ - row;
    const auto column = cross.col(static_cast<Eigen::Index>(k));
    p.row(row).head(row) = column.head(row).transpose();
    p.col(row).segment(row, below) = column.tail(below);
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {  // between rows that wrote `cross`
    for (std::size_t j = 0; j <= i; ++j) {
      p(std::max(rows[i], rows[j]), std::min(rows[i], rows[j])) =
          own(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
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
