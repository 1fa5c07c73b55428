// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>

#include "alidade/state/eigen_alignment.h"

namespace alidade {

/// Matrix in row-major order, which is the order of the plugin ABI.
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Read-only view of a matrix or of a block of a matrix.
using ConstMatrix = Eigen::Ref<const Eigen::MatrixXd>;

/// Columns of a Jacobian that belong to one block of the state.
struct JacobianPart {
  int offset;  ///< offset of the block in the covariance
  int size;
  int column;  ///< index of the first of these columns
};

/// Non-zero columns of a Jacobian with m rows and n columns. If `columns` contains an index twice,
/// the two columns are added.
struct JacobianRows {
  const double* data;  ///< m x width, row-major
  int rows;
  std::span<const int> columns;  ///< row of P to which each of the `width` columns belongs

  int width() const { return static_cast<int>(columns.size()); }
};

}  // namespace alidade
