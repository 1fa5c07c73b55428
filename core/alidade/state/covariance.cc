// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/covariance.h"

#include <algorithm>

#include "alidade/base/error.h"
#include "alidade/state/small_kernels.h"

namespace alidade {

Eigen::MatrixXd Times(const std::vector<JacobianBlock>& h, int rows,
                      const Eigen::MatrixXd& columns) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(rows, columns.cols());
  for (const JacobianBlock& part : h) {
    result += part.block * columns.middleRows(part.offset, part.block.cols());
  }
  return result;
}

int Covariance::Add(int rows) {
  const int gap = FindGap(rows);
  if (gap >= 0) {
    TakeFromGap(gap, rows);
    return gap;
  }
  const int offset = size_;
  if (size_ + rows > p_.rows()) {
    const Eigen::Index capacity = std::max<Eigen::Index>(2 * p_.rows(), size_ + rows);
    Eigen::MatrixXd larger = Eigen::MatrixXd::Zero(capacity, capacity);
    larger.topLeftCorner(size_, size_) = p_.topLeftCorner(size_, size_);
    p_.swap(larger);
  }
  size_ += rows;
  return offset;
}

int Covariance::FindGap(int rows) const {
  auto best = gaps_.end();
  for (auto gap = gaps_.begin(); gap != gaps_.end(); ++gap) {
    if (gap->second < rows) continue;
    if (best == gaps_.end() || gap->second < best->second) best = gap;
  }
  return best == gaps_.end() ? -1 : best->first;
}

/// Takes [offset, offset + rows) out of the gap that it lies in.
void Covariance::TakeFromGap(int offset, int rows) {
  const auto gap = std::find_if(gaps_.begin(), gaps_.end(), [&](const auto& g) {
    return g.first <= offset && offset + rows <= g.first + g.second;
  });
  ALIDADE_EXPECTS(gap != gaps_.end());
  const auto [first, size] = *gap;
  gaps_.erase(gap);
  if (first < offset) gaps_.emplace_back(first, offset - first);
  const int end = offset + rows;
  if (end < first + size) gaps_.emplace_back(end, first + size - end);
}

void Covariance::Release(int offset, int rows) {
  p_.block(offset, 0, rows, offset).setZero();
  p_.block(offset, offset, size_ - offset, rows).setZero();
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

void Covariance::Move(int from, int to, int rows) {
  TakeFromGap(to, rows);
  Eigen::MatrixXd cross(size_, rows);
  cross.topRows(from) = p_.block(from, 0, rows, from).transpose();
  cross.bottomRows(size_ - from) = p_.block(from, from, size_ - from, rows);
  SetRows(to, Block(from, rows, from, rows), cross);
  Release(from, rows);
}

Eigen::MatrixXd Covariance::Block(int a, int rows, int b, int columns) const {
  if (a == b) return p_.block(a, a, rows, rows).selfadjointView<Eigen::Lower>();
  if (a > b) return p_.block(a, b, rows, columns);
  return p_.block(b, a, columns, rows).transpose();
}

void Covariance::SetBlock(int a, int b, const Eigen::Ref<const Eigen::MatrixXd>& value) {
  if (a == b) {
    p_.block(a, a, value.rows(), value.rows()).triangularView<Eigen::Lower>() = value;
  } else if (a > b) {
    p_.block(a, b, value.rows(), value.cols()) = value;
  } else {
    p_.block(b, a, value.cols(), value.rows()) = value.transpose();
  }
}

void Covariance::SetRows(int offset, const Eigen::MatrixXd& own, const Eigen::MatrixXd& cross) {
  const Eigen::Index k = own.rows();
  const Eigen::Index below = size_ - offset - k;
  p_.block(offset, 0, k, offset) = cross.topRows(offset).transpose();
  p_.block(offset + k, offset, below, k) = cross.middleRows(offset + k, below);
  SetBlock(offset, offset, own);
}

Eigen::MatrixXd Covariance::TimesTransposed(const std::vector<JacobianBlock>& h, int rows) const {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(size_, rows);
  for (const JacobianBlock& part : h) {
    const Eigen::Index o = part.offset, k = part.block.cols(), below = size_ - o - k;
    const auto jt = part.block.transpose();
    result.topRows(o).noalias() += p_.block(o, 0, k, o).transpose() * jt;
    result.middleRows(o, k).noalias() +=
        p_.block(o, o, k, k).selfadjointView<Eigen::Lower>() * Eigen::MatrixXd(jt);
    result.bottomRows(below).noalias() += p_.block(o + k, o, below, k) * jt;
  }
  return result;
}

void Covariance::Propagate(const std::vector<std::pair<int, int>>& segments,
                           const Eigen::MatrixXd& f, const Eigen::MatrixXd& q) {
  std::vector<JacobianBlock> rows;
  Eigen::Index at = 0;
  for (const auto& [offset, size] : segments) {
    rows.push_back({offset, f.middleCols(at, size)});
    at += size;
  }
  const Eigen::MatrixXd cross = TimesTransposed(rows, static_cast<int>(f.rows()));
  const Eigen::MatrixXd own = Times(rows, static_cast<int>(f.rows()), cross) + q;
  at = 0;
  for (const auto& [offset, size] : segments) {
    SetRows(offset, own.block(at, at, size, size), cross.middleCols(at, size));
    at += size;
  }
  // Between segments SetRows wrote P_ai F_i'; there both sides move.
  Eigen::Index row = 0;
  for (const auto& [a, a_size] : segments) {
    Eigen::Index column = 0;
    for (const auto& [b, b_size] : segments) {
      if (column < row) SetBlock(a, b, own.block(row, column, a_size, b_size));
      column += b_size;
    }
    row += a_size;
  }
}

void Covariance::Propagate(int offset, int k, const double* f, const double* q) {
  const int ld = static_cast<int>(p_.rows());
  if (small()) return internal::SmallKernelsFor(size_).propagate(p_.data(), ld, offset, k, f, q);
  const Eigen::Map<const RowMajor> fm(f, k, k), qm(q, k, k);
  Propagate({{offset, k}}, fm, qm);
}

void Covariance::Project(const JacobianRows& h, double* pht, double* s) const {
  if (small() && h.whole) {
    const int ld = static_cast<int>(p_.rows());
    return internal::SmallKernelsFor(size_).project(p_.data(), ld, h.data, h.rows, pht, s);
  }
  using Strided = Eigen::Map<const RowMajor, 0, Eigen::OuterStride<>>;
  Eigen::Map<Eigen::MatrixXd> product(pht, size_, h.rows);
  Eigen::Map<Eigen::MatrixXd> sum(s, h.rows, h.rows);
  product.setZero();
  for (const JacobianPart& part : h.parts) {
    const int o = part.offset, k = part.size, below = size_ - o - k;
    const Strided j(h.data + part.column, h.rows, k, Eigen::OuterStride<>(h.stride));
    product.topRows(o).noalias() += p_.block(o, 0, k, o).transpose() * j.transpose();
    product.middleRows(o, k).noalias() +=
        p_.block(o, o, k, k).selfadjointView<Eigen::Lower>() * j.transpose();
    product.bottomRows(below).noalias() += p_.block(o + k, o, below, k) * j.transpose();
  }
  for (const JacobianPart& part : h.parts) {
    const Strided j(h.data + part.column, h.rows, part.size, Eigen::OuterStride<>(h.stride));
    sum.noalias() += j * product.middleRows(part.offset, part.size);
  }
}

bool Covariance::Solve(int m, const double* pht, const double* s, const double* r, double* w,
                       double* inverse_d, double* dx, double* gain) const {
  return internal::SmallKernelsFor(size_).solve(m, pht, s, m, r, w, inverse_d, dx, gain);
}

bool Covariance::Downdate(int m, const double* w, const double* inverse_d) {
  return internal::SmallKernelsFor(size_).downdate(p_.data(), static_cast<int>(p_.rows()), m, w,
                                                   inverse_d);
}

void Covariance::SubtractOuter(const Eigen::MatrixXd& w) {
  p_.topLeftCorner(size_, size_).selfadjointView<Eigen::Lower>().rankUpdate(w, -1.0);
}

void Covariance::AddOuter(const Eigen::MatrixXd& w) {
  for (Eigen::Index c = 0; c < w.rows(); ++c) {
    if (w.row(c).isZero(0.0)) continue;
    for (Eigen::Index r = c; r < w.rows(); ++r) {
      if (!w.row(r).isZero(0.0)) p_(r, c) += w.row(r).dot(w.row(c));
    }
  }
}

void Covariance::Joseph(const Eigen::MatrixXd& k, const Eigen::MatrixXd& h,
                        const Eigen::MatrixXd& r) {
  Eigen::MatrixXd a = Dense();
  const Eigen::MatrixXd hp = h * a;
  a.noalias() -= k * hp;  // (I - K H) P
  const Eigen::MatrixXd ah = a * h.transpose(), kr = k * r;
  a.noalias() += (kr - ah) * k.transpose();
  SetBlock(0, 0, a);
}

void Covariance::Transform(int offset, const Eigen::MatrixXd& j) {
  Propagate({{offset, static_cast<int>(j.cols())}}, j, Eigen::MatrixXd::Zero(j.rows(), j.rows()));
}

Eigen::MatrixXd Covariance::Dense() const {
  return p_.topLeftCorner(size_, size_).selfadjointView<Eigen::Lower>();
}

}  // namespace alidade
