// SPDX-License-Identifier: Apache-2.0
#include "motion_models/constant_velocity.h"

#include <gtest/gtest.h>

#include "support/model_checks.h"
#include "support/model_maker.h"

namespace alidade {
namespace {

using testing::AbiMotion;
using testing::Blocks;
using testing::Covariance;
using testing::ExpectTrueJacobians;
using testing::StepResult;
using testing::StepWithJacobians;

template <int D, bool kContinuous>
void CheckConstantVelocity() {
  const double sigma = 0.7, dt_s = 0.2;
  const SharedMotion motion =
      AbiMotion<ConstantVelocity<D, kContinuous>>({{"noise.acceleration", {sigma}}});
  ASSERT_EQ(motion->noise_size(), kContinuous ? 2 * D : D);
  EXPECT_EQ(motion->discrete_noise(), !kContinuous);
  Blocks x{std::vector<double>(D), std::vector<double>(D)};
  std::vector<double> w(motion->noise_size());
  for (int i = 0; i < D; ++i) x[0][i] = 1.0 + i, x[1][i] = -0.5 * i + 0.25;
  for (std::size_t i = 0; i < w.size(); ++i) w[i] = 0.3 - 0.1 * static_cast<double>(i);
  const StepResult out = StepWithJacobians(motion, x, nullptr, nullptr, dt_s);
  for (int i = 0; i < D; ++i) {
    EXPECT_DOUBLE_EQ(out.next[0][i], x[0][i] + dt_s * x[1][i]);
    EXPECT_EQ(out.next[1][i], x[1][i]);
  }
  ExpectTrueJacobians(motion, x, nullptr, w, dt_s);
  EXPECT_LT(testing::DefectOfParts(motion, x, nullptr, 0.03, 0.17), 1e-15);
  // G Qw G' of each axis:
  // discrete    sigma^2 [dt^4/4 dt^3/2; . dt^2]
  // continuous  sigma^2 [dt^3/3 dt^2/2; . dt]
  const double s2 = sigma * sigma, t = dt_s;
  const double pp = kContinuous ? t * t * t / 3 : t * t * t * t / 4;
  const double pv = kContinuous ? t * t / 2 : t * t * t / 2;
  const double vv = kContinuous ? t : t * t;
  const std::vector<double> q = Covariance(motion, x, dt_s);
  const int n = 2 * D, m = motion->noise_size();
  for (int r = 0; r < n; ++r) {
    for (int c = 0; c < n; ++c) {
      double sum = 0.0;
      for (int i = 0; i < m * m; ++i) {
        sum += out.g[r * m + i / m] * q[i] * out.g[c * m + i % m];
      }
      const double axis = r < D && c < D ? pp : r >= D && c >= D ? vv : pv;
      EXPECT_NEAR(sum, r % D == c % D ? s2 * axis : 0.0, 1e-16) << r << ' ' << c;
    }
  }
}

TEST(ConstantVelocity, MovesAndSpreadsAsItsEquationsSay) {
  CheckConstantVelocity<1, false>();
  CheckConstantVelocity<2, false>();
  CheckConstantVelocity<3, false>();
  CheckConstantVelocity<1, true>();
  CheckConstantVelocity<2, true>();
  CheckConstantVelocity<3, true>();
}

}  // namespace
}  // namespace alidade
