// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "alidade/state/covariance.h"
#include "alidade/state/panels.h"

/// What a Jacobian H (m x n) makes of a covariance P: all of it reads the lower triangle alone.
namespace alidade {

/// pht = P H' (n x m, by columns) and s += H P H' (m x m). O(n m k), k the columns of H's parts.
void Project(const Covariance& p, const JacobianRows& h, double* pht, double* s);
/// pht = P H' of all rows, one after the other: n x m, m in all.
void Project(const Covariance& p, std::span<const JacobianRows> rows, const internal::Panels& pht);
/// s += H P H' alone (m x m). O(m k^2).
void AddProjection(const Covariance& p, const JacobianRows& h, double* s);

}  // namespace alidade
