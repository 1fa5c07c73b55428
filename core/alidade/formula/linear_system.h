// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace alidade::internal {

/// Linear equation with white noise, n states and m control inputs. It is either
///
///   continuous  dx/dt = A x + B u + w,   w has the spectral density Q, or
///   discrete    x(t + period) = A x(t) + B u + w,   w ~ N(0, Q).
struct LinearSystem {
  Eigen::MatrixXd a;      ///< n x n
  Eigen::MatrixXd b;      ///< n x m
  Eigen::MatrixXd noise;  ///< Q, n x n
};

/// Returns the discrete equation that solves the continuous equation exactly over dt, with an input
/// that is constant over dt:
///
///   F = exp(A dt),   B_d = int_0^dt exp(A s) ds B,   Q_d = int_0^dt exp(A s) Q exp(A' s) ds
///
/// Van Loan's method yields the same matrices. The series in dt is summed over dt / 2^k, with k so
/// large that it converges, and the step is then doubled k times. The exponential of -A dt, which
/// overflows if a mode decays fast, is not needed.
/// Source       [VanLoan1978].
LinearSystem Discretise(const LinearSystem& continuous, double dt_s);

/// Returns `count` steps of a discrete equation as one step, with the same input in each step.
LinearSystem Repeat(LinearSystem step, std::int64_t count);

}  // namespace alidade::internal
