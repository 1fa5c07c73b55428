// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>

namespace alidade::internal {

/// A derivative with an estimate of its error, element by element.
struct Derivative {
  Eigen::ArrayXd value, error;
};

/// t -> y(t), or nothing where y is not defined.
using Curve = std::function<std::optional<Eigen::ArrayXd>(double t)>;

/// dy/dt at t = 0: central differences at steps h, h/1.4, h/1.4^2, ... extrapolated to step 0
/// (Richardson), each element taken where its tableau changes least [Ridders1982]. Nothing where y
/// is not defined at one of the steps.
std::optional<Derivative> Differentiate(const Curve& y, double h);

/// The smallest step of Differentiate, as a part of h.
inline constexpr double kSmallestStep = 0.048;  // 1.4^-9

}  // namespace alidade::internal
