// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <vector>

#include "alidade/plugin/plugin_models.h"
#include "alidade/testing/jacobians.h"

/// Checks that several tests of models use. The checks call the models through the plugin ABI.
namespace alidade::testing {

inline constexpr double kPoison = 1e302;
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
// Tolerance of numeric Jacobians. The error is h^4 = 1e-12 times derivatives of about 1e2. The
// rounding error is 1e-13 after division by h.
inline constexpr double kNumeric = 1e-9;

inline void ExpectSame(const std::vector<double>& a, const std::vector<double>& b,
                       double relative) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_NEAR(a[i], b[i], relative * (1.0 + std::abs(b[i]))) << "entry " << i;
  }
}

/// Compares F and G of a step with numeric Jacobians. The step has the noise w.
inline void ExpectTrueJacobians(const SharedMotion& motion, const Blocks& x, const double* u,
                                const std::vector<double>& w, double dt_s) {
  const StepResult out = StepWithJacobians(motion, x, u, w.data(), dt_s),
                   numeric = NumericStep(motion, x, u, w.data(), dt_s);
  EXPECT_EQ(out.next, numeric.next) << "the value is the same with and without Jacobians";
  ExpectSame(out.f, numeric.f, kNumeric);
  ExpectSame(out.g, numeric.g, kNumeric);
}

/// Returns the covariance L L' of the process noise, n_w x n_w.
inline std::vector<double> Covariance(const SharedMotion& motion, const Blocks& x, double dt_s,
                                      const double* u = nullptr) {
  const int n = motion->noise_size();
  std::vector<double> l(n * n, kPoison), q(n * n);
  EXPECT_EQ(motion->SqrtQ(Pointers(x).data(), u, dt_s, l.data()), Status::kOk);
  for (int r = 0; r < n; ++r) {
    for (int c = 0; c < n; ++c) {
      for (int k = 0; k < n; ++k) q[r * n + c] += l[r * n + k] * l[c * n + k];
    }
  }
  return q;
}

/// Linearised step without noise: F, and N = G Lq. Lq is evaluated at the state `noise_of` for the
/// duration noise_dt_s.
struct NoisyStep {
  Blocks next;
  Eigen::MatrixXd f, n;
};
inline NoisyStep StepWithNoise(const SharedMotion& motion, const Blocks& x, const double* u,
                               double dt_s, const Blocks& noise_of, double noise_dt_s) {
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const int n = motion->tangent_size(), n_w = motion->noise_size();
  const StepResult step = StepWithJacobians(motion, x, u, nullptr, dt_s);
  Rows l = Rows::Zero(n_w, n_w);
  EXPECT_EQ(motion->SqrtQ(Pointers(noise_of).data(), u, noise_dt_s, l.data()), Status::kOk);
  return {step.next, Eigen::Map<const Rows>(step.f.data(), n, n),
          Eigen::Map<const Rows>(step.g.data(), n, n_w) * l};
}

/// Returns the relative difference between the noise of two steps and that of one step over both
/// durations. The difference is computed for the noise kind that the model declares.
inline double DefectOfParts(const SharedMotion& motion, const Blocks& x, const double* u,
                            double first_s, double second_s) {
  const double both_s = first_s + second_s;
  const Eigen::MatrixXd n = StepWithNoise(motion, x, u, both_s, x, both_s).n;
  const NoisyStep first = StepWithNoise(motion, x, u, first_s, x, first_s);
  if (motion->discrete_noise()) {
    const NoisyStep second = StepWithNoise(motion, first.next, u, second_s, x, first_s);
    return (second.f * first.n + second.n - n).norm() / n.norm();
  }
  const NoisyStep second = StepWithNoise(motion, first.next, u, second_s, first.next, second_s);
  const Eigen::MatrixXd moved = second.f * first.n;
  const Eigen::MatrixXd q = moved * moved.transpose() + second.n * second.n.transpose();
  return (q - n * n.transpose()).norm() / (n * n.transpose()).norm();
}

}  // namespace alidade::testing
