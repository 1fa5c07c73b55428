// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/outside_correlation.h"

#include "alidade/state/vector_kernels.h"

namespace alidade {

void OutsideCorrelation::Grow(int columns) {
  columns_ += columns;
  Resize(rows_);
}

void OutsideCorrelation::Resize(int rows) {
  rows_ = rows;
  if (columns_ == 0) return;
  if (std::ssize(still_) < rows_) still_.resize(static_cast<std::size_t>(rows_), char{0});
  if (columns_ <= phi_.rows() && rows_ <= phi_.cols()) return;
  const auto room = [](Eigen::Index has, Eigen::Index needs) {
    return needs <= has ? has : std::max(2 * has, needs);
  };
  Eigen::MatrixXd larger =
      Eigen::MatrixXd::Zero(room(phi_.rows(), columns_), room(phi_.cols(), rows_));
  larger.topLeftCorner(phi_.rows(), phi_.cols()) = phi_;
  phi_.swap(larger);
}

void OutsideCorrelation::SetParts(std::span<const JacobianPart> parts, const ConstMatrix& phi) {
  if (columns_ == 0) return;
  for (const JacobianPart& part : parts) {
    phi_.block(0, part.offset, columns_, part.size) = phi.middleCols(part.column, part.size);
    std::fill_n(still_.begin() + part.offset, part.size, char{0});
  }
}

void OutsideCorrelation::Project(const JacobianRows& h, double* hphi) const {
  const long k = columns_;
  std::fill_n(hphi, k * h.rows, 0.0);
  for (const JacobianPart& part : h.parts) {
    internal::BestVectorKernels().combine(k, part.size, h.rows,
                                          phi_.data() + part.offset * phi_.rows(), phi_.rows(),
                                          h.data + part.column, h.stride, hphi, k);
  }
}

void OutsideCorrelation::Zero(int offset, int rows) {
  if (columns_ == 0) return;
  phi_.middleCols(offset, rows).setZero();
  std::fill_n(still_.begin() + offset, rows, char{0});
}

void OutsideCorrelation::Copy(int from, int to, int rows) {
  if (columns_ == 0) return;
  phi_.middleCols(to, rows) = phi_.middleCols(from, rows);
  std::copy_n(still_.begin() + from, rows, still_.begin() + to);
}

void OutsideCorrelation::Clear() {
  phi_.setZero();
  still_.clear();
  columns_ = rows_ = 0;
}

void OutsideCorrelation::Propagate(const JacobianRows& f, Workspace& memory) {
  if (columns_ == 0) return;
  const Workspace::Use use(memory);
  Workspace::Matrix moved = memory.Take(columns_, f.rows);
  Project(f, moved.data());
  SetParts(f.parts, moved);
}

}  // namespace alidade
