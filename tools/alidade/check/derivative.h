// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>

namespace alidade::internal {

/// Derivative with an error estimate for each element.
struct Derivative {
  Eigen::ArrayXd value, error;
};

/// Function y(t). Returns nullopt if y is not defined at t.
using Curve = std::function<std::optional<Eigen::ArrayXd>(double t)>;

/// Computes dy/dt at t = 0 from central differences with the steps h, h/1.4, h/1.4^2, ... The
/// differences are extrapolated to step 0 (Richardson). Each element of the result is the tableau
/// entry with the smallest error estimate [Ridders1982]. Returns nullopt if y is not defined at one
/// of the steps.
std::optional<Derivative> Differentiate(const Curve& y, double h);

/// Smallest step of Differentiate, as a fraction of h.
inline constexpr double kSmallestStep = 0.048;  // 1.4^-9

}  // namespace alidade::internal
