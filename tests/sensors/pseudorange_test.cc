// SPDX-License-Identifier: Apache-2.0
#include "sensors/pseudorange.h"

#include <gtest/gtest.h>

#include "alidade/base/error.h"
#include "alidade/estimation/direct_models.h"
#include "support/model_checks.h"

namespace alidade {
namespace {

using testing::Blocks;
using testing::kPoison;
using testing::Pointers;

// The receiver is at (1, 2, 3) m and has a clock bias of 7 m. The transmitter is 3 m north of the
// receiver and 4 m above it.
const Blocks kPseudorangeRoles{{1, 2, 3}, {7}};
const double kTransmitter[3] = {1, 5, 7};

TEST(Pseudorange, PredictsWorkedNumbers) {
  const SharedSensor sensor = MakeSensor(Pseudorange(2.0), "pseudorange");
  EXPECT_EQ(sensor->known_size(), 3);
  EXPECT_EQ(ColumnNames("s", sensor->known())[2], "s.z");
  double z = kPoison, l = kPoison, by_position[3], by_bias;
  double* const jacobians[] = {by_position, &by_bias};
  const int strides[] = {3, 1};
  ASSERT_EQ(
      sensor->Linearise(Pointers(kPseudorangeRoles).data(), &z, jacobians, strides, kTransmitter),
      Status::kOk);
  EXPECT_DOUBLE_EQ(z, 12.0);
  EXPECT_DOUBLE_EQ(by_position[0], 0.0);
  EXPECT_DOUBLE_EQ(by_position[1], -0.6);
  EXPECT_DOUBLE_EQ(by_position[2], -0.8);
  EXPECT_DOUBLE_EQ(by_bias, 1.0);
  ASSERT_EQ(sensor->SqrtNoise(Pointers(kPseudorangeRoles).data(), &z, &l, kTransmitter),
            Status::kOk);
  EXPECT_EQ(l, 2.0);
}

TEST(Pseudorange, IsNotDefinedAtTheTransmitter) {
  const SharedSensor sensor = MakeSensor(Pseudorange(2.0), "pseudorange");
  double z = kPoison;
  EXPECT_EQ(sensor->Predict(Pointers(kPseudorangeRoles).data(), &z, kPseudorangeRoles[0].data()),
            Status::kOutOfDomain);
  EXPECT_EQ(z, kPoison);
  EXPECT_THROW(static_cast<void>(sensor->Predict(Pointers(kPseudorangeRoles).data(), &z)),
               ContractViolation)
      << "the position of the transmitter is missing";
}

TEST(Pseudorange, OwnsTheClock) {
  const SharedSensor sensor = MakeSensor(Pseudorange(2.0), "pseudorange");
  EXPECT_NE(sensor->roles()[1].flags & ALIDADE_ROLE_OWNED, 0u);
  const OwnedRole clock = sensor->owned(1);
  EXPECT_EQ(clock.dynamics, OwnedDynamics::kRandomWalk);
  EXPECT_EQ(clock.sqrt_prior, std::vector<double>{1e5});
  EXPECT_EQ(clock.sqrt_density, std::vector<double>{1.0});
}

}  // namespace
}  // namespace alidade
