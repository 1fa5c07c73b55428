// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "alidade/plugin/plugin_models.h"
#include "support/model_checks.h"

/// Numerical integration of differential equations, as an independent check of motion models.
namespace alidade::testing {

/// Integrates dx/dt = f(x) over dt_s by the method of Runge and Kutta of order 4.
template <class X, class F>
X RungeKutta(X x, double dt_s, const F& f, int steps = 2000) {
  const double h = dt_s / steps;
  for (int i = 0; i < steps; ++i) {
    const X k1 = f(x), k2 = f(X(x + 0.5 * h * k1)), k3 = f(X(x + 0.5 * h * k2)),
            k4 = f(X(x + h * k3));
    x += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
  }
  return x;
}

/// Returns the covariance at dt_s of dx = F x dt + white noise of density q, with x(0) = 0, from
/// dP/dt = F P + P F' + q.
inline Eigen::MatrixXd IntegratedNoise(const Eigen::MatrixXd& f, const Eigen::MatrixXd& q,
                                       double dt_s) {
  const auto change = [&](const Eigen::MatrixXd& p) {
    return Eigen::MatrixXd(f * p + p * f.transpose() + q);
  };
  return RungeKutta(Eigen::MatrixXd::Zero(f.rows(), f.cols()).eval(), dt_s, change);
}

/// Returns the covariance of x' that the continuous noise of `steps` equal steps causes.
inline Eigen::MatrixXd NoiseOfSteps(const SharedMotion& motion, Blocks x, const double* u,
                                    double dt_s, int steps) {
  const int n = motion->tangent_size();
  Eigen::MatrixXd p = Eigen::MatrixXd::Zero(n, n);
  for (int i = 0; i < steps; ++i) {
    const NoisyStep step = StepWithNoise(motion, x, u, dt_s / steps, x, dt_s / steps);
    p = (step.f * p * step.f.transpose() + step.n * step.n.transpose()).eval();
    x = step.next;
  }
  return p;
}

/// Expects a = b up to `relative` times the geometric mean of the variances of row and column.
inline void ExpectSameCovariance(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b,
                                 double relative) {
  ASSERT_EQ(a.rows(), b.rows());
  for (Eigen::Index r = 0; r < a.rows(); ++r) {
    for (Eigen::Index c = 0; c < a.cols(); ++c) {
      EXPECT_NEAR(a(r, c), b(r, c), relative * std::sqrt(b(r, r) * b(c, c)) + 1e-300)
          << r << ' ' << c;
    }
  }
}

/// Expects that one step without noise over `first_s` + `second_s` equals two steps.
inline void ExpectAdditive(const SharedMotion& motion, const Blocks& x, const double* u,
                           double first_s, double second_s, double tolerance = 1e-12) {
  const Blocks once = StepWithJacobians(motion, x, u, nullptr, first_s + second_s).next;
  const Blocks between = StepWithJacobians(motion, x, u, nullptr, first_s).next;
  const Blocks twice = StepWithJacobians(motion, between, u, nullptr, second_s).next;
  for (std::size_t b = 0; b < once.size(); ++b) {
    const Geometry& geometry = motion->blocks()[b].geometry;
    std::vector<double> d(static_cast<std::size_t>(geometry.tangent));
    geometry.Minus(once[b].data(), twice[b].data(), d.data());
    for (const double element : d) EXPECT_NEAR(element, 0.0, tolerance) << "block " << b;
  }
}

}  // namespace alidade::testing
