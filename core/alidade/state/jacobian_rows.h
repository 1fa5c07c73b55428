// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>

#include "alidade/state/eigen_alignment.h"

namespace alidade {

/// Row-major matrix, as in the plugin ABI.
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Read-only view of a matrix or of a block of a matrix.
using ConstMatrix = Eigen::Ref<const Eigen::MatrixXd>;

/// Columns of a Jacobian that belong to one block of the state.
struct JacobianPart {
  int offset;  ///< offset of the block in the covariance
  int size;
  int column;  ///< index of the first of these columns
};

/// Non-zero columns of a Jacobian with m rows and n columns. If a column is listed twice, its value
/// is the sum of both.
struct JacobianRows {
  const double* data;  ///< m x width, row-major
  int rows;
  std::span<const int> columns;  ///< index in P of each column; `width` indices

  int width() const { return static_cast<int>(columns.size()); }
};

}  // namespace alidade
