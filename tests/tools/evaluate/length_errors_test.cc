// SPDX-License-Identifier: Apache-2.0
#include "alidade/evaluate/length_errors.h"

#include <gtest/gtest.h>

#include "alidade/base/statistics.h"
#include "support/trajectories.h"

namespace alidade::internal {
namespace {

using testing::Line;

/// 101 poses 1 m apart. The steps of the estimate are 1.02 m long, so its relative error is 0.02 /
/// 1.02 of the length. The path of the estimate is 102 m long, so the lengths end at 50 m. No two
/// poses are 0.5 m apart.
TEST(LengthErrors, AreRelativeToTheLength) {
  const auto errors = ErrorsOverLengths(Line(101, 1.0), Line(101, 1.02));
  std::vector<double> lengths;
  for (const LengthErrors& entry : errors) {
    lengths.push_back(entry.length_m);
    EXPECT_NEAR(Quantile(entry.translations, 0.5), 0.02 / 1.02, 0.03 * 0.02);
    EXPECT_NEAR(entry.angles_deg.back(), 0.0, 1e-6);
    EXPECT_EQ(entry.translations.size(), entry.angles_deg.size());
  }
  EXPECT_EQ(lengths, (std::vector<double>{1.0, 2.0, 5.0, 10.0, 20.0, 50.0}));
}

TEST(LengthErrors, AreEmptyForATrajectoryAtRest) {
  EXPECT_TRUE(ErrorsOverLengths(Line(10, 0.0), Line(10, 0.0)).empty());
}

}  // namespace
}  // namespace alidade::internal
