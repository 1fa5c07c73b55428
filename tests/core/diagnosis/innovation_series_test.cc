// SPDX-License-Identifier: Apache-2.0
#include "alidade/diagnosis/innovation_series.h"

#include <gtest/gtest.h>

#include "alidade/estimation/models.h"
#include "sensors/pose.h"

namespace alidade {
namespace {

using Texts = std::vector<std::string>;

TEST(InnovationSeries, HasTheUnitsOfTheParts) {
  const SensorBinding binding{
      "mocap", "pose", MakeSensor(Pose<3>({0.1, 0.1, 0.1}, {0.01, 0.01, 0.01}), "pose"), {}};
  const InnovationSeries series(binding);
  EXPECT_EQ(series.units, (Texts{"m", "m", "m", "", "", "", ""}));
  EXPECT_EQ(series.z_index, (std::vector<int>{0, 1, 2, -1, -1, -1}));
}

}  // namespace
}  // namespace alidade
