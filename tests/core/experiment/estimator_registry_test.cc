// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/estimator_registry.h"

#include <gtest/gtest.h>

#include "alidade/base/error.h"

namespace alidade {
namespace {

TEST(EstimatorTypes, RefuseAnOptionOutOfRangeByItsPlace) {
  const Config config = Config::FromText("alpha: 1e-9", "ukf.yaml");
  try {
    internal::FindEstimatorType("ukf")->read(config.root());
    FAIL() << "alpha 1e-9 was accepted; expected an error";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(),
                 "ukf.yaml:1:8 alpha: '1e-9' is out of range; expected a number in [1e-04, 1]");
  }
}

}  // namespace
}  // namespace alidade
