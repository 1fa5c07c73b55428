// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/covariance.h"

#include <algorithm>

#include "alidade/state/projection.h"
#include "alidade/state/small_kernels.h"

namespace alidade {

int Covariance::Add(int rows) {
  if (const int gap = TakeGap(rows); gap >= 0) return gap;
  const int offset = size_;
  Reserve(rows);
  size_ += rows;
  return offset;
}

void Covariance::Reserve(int rows) {
  if (size_ + rows <= p_.rows()) return;
  // An eighth more than asked for: a landmark that takes another form is there twice for a while.
  const Eigen::Index needed = size_ + rows, capacity = std::max(2 * p_.rows(), needed + needed / 8);
  Eigen::MatrixXd larger = Eigen::MatrixXd::Zero(capacity, capacity);
  larger.topLeftCorner(size_, size_) = p_.topLeftCorner(size_, size_);
  p_.swap(larger);
}

void Covariance::Clear() {
  p_.topLeftCorner(size_, size_).setZero();
  size_ = 0;
  gaps_.clear();
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
  p_.block(offset, 0, rows, offset).setZero();
  p_.block(offset, offset, size_ - offset, rows).setZero();
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
  cross.topRows(from) = p_.block(from, 0, rows, from).transpose();
  cross.bottomRows(size_ - from) = p_.block(from, from, size_ - from, rows);
  SetRows(to, cross.middleRows(from, rows), cross);
  Release(from, rows);
  return to;
}

Eigen::MatrixXd Covariance::Block(int a, int rows, int b, int columns) const {
  if (a == b) return p_.block(a, a, rows, rows).selfadjointView<Eigen::Lower>();
  if (a > b) return p_.block(a, b, rows, columns);
  return p_.block(b, a, columns, rows).transpose();
}

void Covariance::SetBlock(int a, int b, const ConstMatrix& value) {
  if (a == b) {
    p_.block(a, a, value.rows(), value.rows()).triangularView<Eigen::Lower>() = value;
  } else if (a > b) {
    p_.block(a, b, value.rows(), value.cols()) = value;
  } else {
    p_.block(b, a, value.cols(), value.rows()) = value.transpose();
  }
}

/// Sets rows [offset, offset + k): `own` (k x k) on the diagonal, `cross` (n x k) elsewhere; its
/// rows [offset, offset + k) are not read.
void Covariance::SetRows(int offset, const ConstMatrix& own, const ConstMatrix& cross) {
  const Eigen::Index k = own.rows();
  const Eigen::Index below = size_ - offset - k;
  p_.block(offset, 0, k, offset) = cross.topRows(offset).transpose();
  p_.block(offset + k, offset, below, k) = cross.middleRows(offset + k, below);
  SetBlock(offset, offset, own);
}

void Covariance::SetRows(int offset, const ConstMatrix& own) {
  Clear(offset, static_cast<int>(own.rows()));
  SetBlock(offset, offset, own);
}

void Covariance::SetParts(std::span<const JacobianPart> parts, const ConstMatrix& own,
                          const ConstMatrix& cross) {
  for (const JacobianPart& a : parts) {
    SetRows(a.offset, own.block(a.column, a.column, a.size, a.size),
            cross.middleCols(a.column, a.size));
  }
  // Between parts that wrote `cross`.
  for (const JacobianPart& a : parts) {
    for (const JacobianPart& b : parts) {
      if (b.column < a.column) {
        SetBlock(a.offset, b.offset, own.block(a.column, b.column, a.size, b.size));
      }
    }
  }
}

void Covariance::Propagate(std::span<const JacobianPart> parts, const double* f, const double* q) {
  int k = 0;
  for (const JacobianPart& part : parts) k += part.size;
  const Workspace::Use use(memory_);
  if (q == nullptr) {
    Workspace::Matrix zero = memory_.Take(k, k);
    zero.setZero();
    q = zero.data();
  }
  if (internal::IsSmall(*this) && parts.size() == 1) {
    const int ld = static_cast<int>(p_.rows());
    return internal::SmallKernelsFor(size_).propagate(p_.data(), ld, parts[0].offset, k, f, q);
  }
  Workspace::Matrix cross = memory_.Take(size_, k), own = memory_.Take(k, k);
  own.setZero();
  Project(*this, {f, k, k, parts}, cross.data(), own.data());
  own += Eigen::Map<const RowMajor>(q, k, k);
  SetParts(parts, own, cross);
}

Eigen::MatrixXd Covariance::Dense() const {
  return p_.topLeftCorner(size_, size_).selfadjointView<Eigen::Lower>();
}

}  // namespace alidade
