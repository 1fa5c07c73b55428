// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "alidade/state/covariance.h"

/// Products of a Jacobian H (m x n) and a covariance P. Only the lower triangle of P is read.
namespace alidade {

/// Computes pht = P H' (n x m, column-major) and s += H P H' (m x m). The cost is O(n m k) if k
/// columns of H are not zero.
void Project(const Covariance& p, const JacobianRows& h, double* pht, double* s);
/// Computes only s += H P H' (m x m). The cost is O(m k^2).
void AddProjection(const Covariance& p, const JacobianRows& h, double* s);

}  // namespace alidade
