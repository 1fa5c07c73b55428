// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>

#include "alidade/state/eigen_alignment.h"

namespace alidade {

/// Matrices as they cross the plugin ABI.
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// A matrix that is read, a block of another one too.
using ConstMatrix = Eigen::Ref<const Eigen::MatrixXd>;

/// The columns of a Jacobian that belong to one block of the state: at `column` of its rows.
struct JacobianPart {
  int offset;  ///< of the block in the covariance
  int size;
  int column;
};

/// m rows of a Jacobian of n columns that is zero but in some; one that is named twice has the sum.
struct JacobianRows {
  const double* data;  ///< m x width, row-major
  int rows;
  std::span<const int> columns;  ///< rows of P, `width` of them

  int width() const { return static_cast<int>(columns.size()); }
};

}  // namespace alidade
