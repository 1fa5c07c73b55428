// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/value_labels.h"

#include <gtest/gtest.h>

namespace alidade::internal {
namespace {

using Labels = std::vector<std::string>;

TEST(ValueLabels, HaveOfLongValuesWhatDiffers) {
  EXPECT_EQ(ValueLabels({"0.5", "{a: 1}", "[1, 2]"}), (Labels{"0.5", "{a: 1}", "[1, 2]"}));
  EXPECT_EQ(ValueLabels({"{model: pinhole, width: 640, fx: 260, fy: 260, cx: 320}",
                         "{model: pinhole, width: 640, fx: 525, fy: 525, cx: 320}"}),
            (Labels{"fx: 260, fy: 260", "fx: 525, fy: 525"}));
  EXPECT_EQ(
      ValueLabels({"{a: {b: 1, c: 2}, and: a long map}", "{a: {b: 3, c: 2}, and: a long map}"}),
      (Labels{"a: {b: 1, c: 2}", "a: {b: 3, c: 2}"}));
  EXPECT_EQ(ValueLabels({"a word that is far too long", "another"}),
            (Labels{"a word that is far to...", "another"}));
}

}  // namespace
}  // namespace alidade::internal
