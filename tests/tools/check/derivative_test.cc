// SPDX-License-Identifier: Apache-2.0
#include "alidade/check/derivative.h"

#include <gtest/gtest.h>

#include <cmath>

namespace alidade::internal {
namespace {

Eigen::ArrayXd Array(std::initializer_list<double> elements) {
  return Eigen::Map<const Eigen::ArrayXd>(elements.begin(),
                                          static_cast<Eigen::Index>(elements.size()));
}

TEST(Derivative, IsThatOfSmoothFunctionsWithinItsError) {
  const Curve y = [](double t) {
    return Array({std::sin(0.7 + t), 3.0 / (2.0 + t), std::exp(5.0 * t), 4.0});
  };
  const auto d = Differentiate(y, 0.1);
  ASSERT_TRUE(d.has_value());
  const double exact[] = {std::cos(0.7), -0.75, 5.0, 0.0};
  for (int i = 0; i < 4; ++i) {
    // The second function has its pole at t = -2, which is at least 20 steps h away.
    EXPECT_NEAR(d->value[i], exact[i], 1e-10) << i;
    EXPECT_LE(std::abs(d->value[i] - exact[i]), 10.0 * d->error[i] + 1e-13) << i;
  }
}

TEST(Derivative, SaysWhereItIsNotToBeTrusted) {
  // |t - 0.03| has a kink at t = 0.03, within the steps, so the tableau does not converge.
  const Curve kink = [](double t) { return Array({std::abs(t - 0.03)}); };
  const auto d = Differentiate(kink, 0.1);
  ASSERT_TRUE(d.has_value());
  EXPECT_GT(d->error[0] + 1e-9, std::abs(d->value[0] + 1.0) / 10.0);
  // The noise is 1e-3 and the steps are about 1e-2.
  int calls = 0;
  const Curve noisy = [&](double) { return Array({++calls % 3 == 0 ? 1e-3 : 0.0}); };
  EXPECT_GT(Differentiate(noisy, 0.1)->error[0], 1e-4);
}

TEST(Derivative, DoesNotExistBesideTheEdgeOfTheDomain) {
  const Curve root = [](double t) -> std::optional<Eigen::ArrayXd> {
    if (t < -0.05) return std::nullopt;
    return Array({std::sqrt(0.05 + t)});
  };
  EXPECT_FALSE(Differentiate(root, 0.1).has_value());
  const auto d = Differentiate(root, 0.01);
  ASSERT_TRUE(d.has_value());
  EXPECT_NEAR(d->value[0], 0.5 / std::sqrt(0.05), 1e-9);
}

}  // namespace
}  // namespace alidade::internal
