// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>

#include "alidade/state/eigen_alignment.h"

namespace alidade {

/// Matrix in the storage order of the plugin ABI.
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Read-only matrix, or a block of one.
using ConstMatrix = Eigen::Ref<const Eigen::MatrixXd>;

/// Columns of a Jacobian that belong to one block of the state.
struct JacobianPart {
  int offset;  ///< of the block in the covariance
  int size;
  int column;  ///< index of the first column
};

/// Non-zero columns of m rows of a Jacobian of n columns. A column that is listed twice is the sum.
struct JacobianRows {
  const double* data;  ///< m x width, row-major
  int rows;
  std::span<const int> columns;  ///< rows of P, `width` of them

  int width() const { return static_cast<int>(columns.size()); }
};

}  // namespace alidade
