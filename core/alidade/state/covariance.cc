// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/covariance.h"

#include <algorithm>
#include <array>

#include "alidade/state/small_kernels.h"
#include "alidade/state/vector_kernels.h"

namespace alidade {
namespace {

/// What the M rows of H from `first` on add to s += H P H'; returns M. Of two entries of P that are
/// one by symmetry it takes the lower one, for both, and half of each on the diagonal.
template <int M>
int AddRows(const Eigen::MatrixXd& p, const JacobianRows& h, int first, double* s) {
  const auto row = [&](int i) { return h.data + std::ptrdiff_t{i} * h.stride; };
  for (const JacobianPart& right : h.parts) {
    for (int c = 0; c < right.size; ++c) {
      const int b = right.offset + c;
      double hp[M] = {};  // H times column b of the lower triangle of P
      const auto add = [&](int column, double value) {
        for (int i = 0; i < M; ++i) hp[i] += row(first + i)[column] * value;
      };
      add(right.column + c, 0.5 * p(b, b));
      for (int d = c + 1; d < right.size; ++d) add(right.column + d, p(right.offset + d, b));
      for (const JacobianPart& left : h.parts) {
        if (left.offset > right.offset) {
          for (int d = 0; d < left.size; ++d) add(left.column + d, p(left.offset + d, b));
        } else if (left.offset == right.offset && &left > &right) {  // two roles of one block
          for (int d = 0; d < left.size; ++d) {
            add(left.column + d, p(left.offset + std::max(c, d), left.offset + std::min(c, d)));
          }
        }
      }
      for (int i = 0; i < M; ++i) {
        for (int k = 0; k < h.rows; ++k) {
          const double both = hp[i] * row(k)[right.column + c];
          s[(first + i) * h.rows + k] += both;
          s[k * h.rows + first + i] += both;
        }
      }
    }
  }
  return M;
}

}  // namespace

int Covariance::Add(int rows) {
  if (const int gap = TakeGap(rows); gap >= 0) return gap;
  const int offset = size_;
  Reserve(rows);
  size_ += rows;
  if (outside_ > 0) GrowOutside(0);
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
  phi_.setZero();
  still_.clear();
  size_ = outside_ = 0;
  gaps_.clear();
}

void Covariance::GrowOutside(int columns) {
  outside_ += columns;
  if (std::ssize(still_) < size_) still_.resize(static_cast<std::size_t>(size_), char{0});
  if (outside_ <= phi_.rows() && size_ <= phi_.cols()) return;
  const auto room = [](Eigen::Index has, Eigen::Index needs) {
    return needs <= has ? has : std::max(2 * has, needs);
  };
  Eigen::MatrixXd larger =
      Eigen::MatrixXd::Zero(room(phi_.rows(), outside_), room(phi_.cols(), size_));
  larger.topLeftCorner(phi_.rows(), phi_.cols()) = phi_;
  phi_.swap(larger);
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
  if (outside_ == 0) return;
  phi_.middleCols(offset, rows).setZero();
  std::fill_n(still_.begin() + offset, rows, char{0});
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
  if (outside_ > 0) {
    phi_.middleCols(to, rows) = phi_.middleCols(from, rows);
    std::copy_n(still_.begin() + from, rows, still_.begin() + to);
  }
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
  if (outside_ > 0) PropagateOutside(parts, f);
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
  Project({f, k, k, parts}, cross.data(), own.data());
  own += Eigen::Map<const RowMajor>(q, k, k);
  SetParts(parts, own, cross);
}

void Covariance::PropagateOutside(std::span<const JacobianPart> parts, const double* f) {
  int k = 0;
  for (const JacobianPart& part : parts) k += part.size;
  Workspace::Matrix moved = memory_.Take(outside_, k);
  ProjectOutside({f, k, k, parts}, moved.data());
  SetOutside(parts, moved);
}

void Covariance::SetOutside(std::span<const JacobianPart> parts, const ConstMatrix& phi) {
  for (const JacobianPart& part : parts) {
    if (outside_ == 0) return;
    phi_.block(0, part.offset, outside_, part.size) = phi.middleCols(part.column, part.size);
    std::fill_n(still_.begin() + part.offset, part.size, char{0});
  }
}

void Covariance::ProjectOutside(const JacobianRows& h, double* hphi) const {
  const long k = outside_;
  std::fill_n(hphi, k * h.rows, 0.0);
  for (const JacobianPart& part : h.parts) {
    internal::BestVectorKernels().combine(k, part.size, h.rows,
                                          phi_.data() + part.offset * phi_.rows(), phi_.rows(),
                                          h.data + part.column, h.stride, hphi, k);
  }
}

void Covariance::AddProjection(const JacobianRows& h, double* s) const {
  if (internal::IsSmall(*this) && h.whole && h.rows <= internal::kSmall) {
    std::array<double, internal::kSmall * internal::kSmall> pht;
    return Project(h, pht.data(), s);
  }
  for (int first = 0; first < h.rows;) {
    switch (h.rows - first) {
      case 1:
        first += AddRows<1>(p_, h, first, s);
        break;
      case 2:
        first += AddRows<2>(p_, h, first, s);
        break;
      default:
        first += AddRows<3>(p_, h, first, s);
    }
  }
}

void Covariance::Project(const JacobianRows& h, double* pht, double* s) const {
  if (internal::IsSmall(*this) && h.whole) {
    const int ld = static_cast<int>(p_.rows());
    return internal::SmallKernelsFor(size_).project(p_.data(), ld, h.data, h.rows, pht, s);
  }
  const long n = size_;
  internal::BestVectorKernels().project(p_.data(), p_.rows(), n, {&h, 1}, pht, 1, n);
  for (int i = 0; i < h.rows; ++i) {
    for (int k = 0; k < h.rows; ++k) {
      double sum = 0.0;
      for (const JacobianPart& part : h.parts) {
        const double* const j = h.data + static_cast<std::ptrdiff_t>(i) * h.stride + part.column;
        for (int c = 0; c < part.size; ++c) sum += j[c] * pht[k * n + part.offset + c];
      }
      s[i * h.rows + k] += sum;
    }
  }
}

void Covariance::Project(std::span<const JacobianRows> rows, const internal::Panels& pht) const {
  internal::BestVectorKernels().project(p_.data(), p_.rows(), size_, rows, pht.data, pht.columns,
                                        pht.height);
}

Eigen::MatrixXd Covariance::Dense() const {
  return p_.topLeftCorner(size_, size_).selfadjointView<Eigen::Lower>();
}

}  // namespace alidade
