// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "alidade/check/model_under_test.h"

/// Conversions of values, differences and Jacobians to types of Eigen.
namespace alidade::internal {

/// Returns the largest magnitude of all elements.
double Largest(const Values& values);

Values OutputValues(const Answer& answer);

/// Computes a (-) b of each space, and stacks the results.
Eigen::ArrayXd Difference(const std::vector<Space>& spaces, const Values& a, const Values& b);

Eigen::MatrixXd ToMatrix(const Buffer& buffer);

/// Concatenates all Jacobians of `answer` horizontally.
Eigen::MatrixXd ConcatenatedJacobian(const Answer& answer);

/// Returns the names of the tangent elements of all spaces, in the order of the spaces.
std::vector<std::string> TangentNames(const std::vector<Space>& spaces);

}  // namespace alidade::internal
