// SPDX-License-Identifier: Apache-2.0
#include "alidade/base/text.h"

#include <gtest/gtest.h>

namespace alidade::internal {
namespace {

TEST(WithArticle, GoesByTheFirstLetter) {
  EXPECT_EQ(WithArticle("source"), "a source");
  EXPECT_EQ(WithArticle("estimator"), "an estimator");
}

}  // namespace
}  // namespace alidade::internal
