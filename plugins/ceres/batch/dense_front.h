// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <cstddef>
#include <vector>

#include "alidade/state/tiles.h"

/// One front [D B'; B C] of a symmetric elimination, of which the lower triangle counts.
namespace alidade::ceres_batch {

/// Rows that lie side by side, both where they are and where they go.
struct RowRun {
  Eigen::Index from, to, size;
};

/// Puts rows behind those that there are, which are all that lie before them where they are.
inline void Append(const RowRun& next, std::vector<RowRun>& runs) {
  if (!runs.empty() && runs.back().to + runs.back().size == next.to) {
    runs.back().size += next.size;
  } else {
    runs.push_back(next);
  }
}

/// Adds `from`, whose rows the runs are, to the front.
inline void AddByRuns(const std::vector<RowRun>& runs, const Eigen::MatrixXd& from,
                      Eigen::MatrixXd& front) {
  for (std::size_t j = 0; j < runs.size(); ++j) {
    const RowRun& b = runs[j];
    front.block(b.to, b.to, b.size, b.size).triangularView<Eigen::Lower>() +=
        from.block(b.from, b.from, b.size, b.size);
    for (std::size_t i = j + 1; i < runs.size(); ++i) {
      const RowRun& a = runs[i];
      const auto part = from.block(a.from, b.from, a.size, b.size);
      if (a.to > b.to) {
        front.block(a.to, b.to, a.size, b.size) += part;
      } else {
        front.block(b.to, a.to, b.size, a.size) += part.transpose();
      }
    }
  }
}

/// Eliminates the first p rows:
///
///   d        D, p x p, factorised
///   x        D^-1 B', p x m
///   update   C - B D^-1 B', m x m, lower triangle
///
/// False where D is singular or not finite.
inline bool Eliminate(const Eigen::MatrixXd& front, Eigen::Index p,
                      Eigen::PartialPivLU<Eigen::MatrixXd>& d, Eigen::MatrixXd& x,
                      Eigen::MatrixXd& update) {
  const Eigen::Index m = front.rows() - p;
  d.compute(Eigen::MatrixXd(front.topLeftCorner(p, p).selfadjointView<Eigen::Lower>()));
  const Eigen::MatrixXd& lu = d.matrixLU();
  if (p > 0 && !(lu.allFinite() && lu.diagonal().cwiseAbs().minCoeff() > 0.0)) return false;
  const auto b = front.bottomLeftCorner(m, p);
  x.resize(p, m);
  if (m > 0) x = d.solve(b.transpose());
  update = front.bottomRightCorner(m, m);
  if (m == 0) return true;
  const Eigen::MatrixXd transposed = x.transpose();
  internal::AddSymmetricProduct(update, b, transposed, -1.0);
  return true;
}

}  // namespace alidade::ceres_batch
