// SPDX-License-Identifier: Apache-2.0
#include "alidade/formula/linear_system.h"

#include <algorithm>
#include <cmath>

#include "alidade/state/dense_algebra.h"

namespace alidade::internal {
namespace {

/// Returns the step `first` and then the step `second`, as one step.
LinearSystem Compose(const LinearSystem& first, const LinearSystem& second) {
  return {Product(second.a, first.a), Product(second.a, first.b) + second.b,
          Congruence(second.a, first.noise) + second.noise};
}

/// Sums the series in dt. The term M of Q_d is followed by (A M + M A') dt / (k + 1). |A dt| must
/// be at most 1/2.
LinearSystem SumSeries(const LinearSystem& continuous, double dt_s) {
  constexpr int kTerms = 20;  // the other terms are below 1 / 20! of the first
  const Eigen::MatrixXd& a = continuous.a;
  LinearSystem term{Eigen::MatrixXd::Identity(a.rows(), a.cols()), continuous.b * dt_s,
                    continuous.noise * dt_s};
  LinearSystem sum = term;
  for (int k = 1; k < kTerms; ++k) {
    const Eigen::MatrixXd product = Product(a, term.noise);
    term.a = Product(a, term.a) * (dt_s / k);
    term.b = Product(a, term.b) * (dt_s / (k + 1));
    term.noise = (product + product.transpose()) * (dt_s / (k + 1));
    sum.a += term.a;
    sum.b += term.b;
    sum.noise += term.noise;
  }
  return sum;
}

}  // namespace

LinearSystem Discretise(const LinearSystem& continuous, double dt_s) {
  constexpr double kMaxDoublings = 1000.0;
  const double norm = continuous.a.cwiseAbs().rowwise().sum().maxCoeff() * std::abs(dt_s);
  const int doublings = static_cast<int>(std::clamp(std::logb(norm) + 2.0, 0.0, kMaxDoublings));
  LinearSystem step = SumSeries(continuous, std::ldexp(dt_s, -doublings));
  for (int i = 0; i < doublings; ++i) step = Compose(step, step);
  return step;
}

LinearSystem Repeat(LinearSystem step, std::int64_t count) {
  const Eigen::Index n = step.a.rows();
  LinearSystem result{Eigen::MatrixXd::Identity(n, n), Eigen::MatrixXd::Zero(n, step.b.cols()),
                      Eigen::MatrixXd::Zero(n, n)};
  for (; count > 0; count /= 2) {
    if (count % 2 == 1) result = Compose(result, step);
    if (count > 1) step = Compose(step, step);
  }
  return result;
}

}  // namespace alidade::internal
