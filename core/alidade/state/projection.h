// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "alidade/state/covariance.h"

/// Products of a Jacobian H (m x n) with a covariance P: all of them read the lower triangle alone.
namespace alidade {

/// pht = P H' (n x m, by columns) and s += H P H' (m x m). O(n m k), k the columns that H has.
void Project(const Covariance& p, const JacobianRows& h, double* pht, double* s);
/// s += H P H' alone (m x m). O(m k^2).
void AddProjection(const Covariance& p, const JacobianRows& h, double* s);

}  // namespace alidade
