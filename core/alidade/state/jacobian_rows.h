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

/// m rows of a Jacobian H, row-major in the caller's memory, that is zero but for its parts.
struct JacobianRows {
  const double* data;
  int rows;
  int stride;  ///< numbers in a row
  std::span<const JacobianPart> parts;
  bool whole = false;  ///< rows are as wide as the covariance, zeros included
};

}  // namespace alidade
