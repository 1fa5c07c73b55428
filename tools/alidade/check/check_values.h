// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "alidade/check/model_under_test.h"

/// What the checks compute with: values, their differences and Jacobians as Eigen sees them.
namespace alidade::internal {

/// The largest magnitude.
double Largest(const Values& values);

Values OutputValues(const Answer& answer);

/// a (-) b, all spaces one below the other.
Eigen::ArrayXd Difference(const std::vector<Space>& spaces, const Values& a, const Values& b);

Eigen::MatrixXd ToMatrix(const Buffer& buffer);

/// All Jacobians of `answer` side by side.
Eigen::MatrixXd SideBySide(const Answer& answer);

/// Of all spaces, one behind the other.
std::vector<std::string> TangentNames(const std::vector<Space>& spaces);

}  // namespace alidade::internal
