// SPDX-License-Identifier: Apache-2.0
#include "sensors/pseudorange_rate.h"

#include <gtest/gtest.h>

#include "support/sensor_checks.h"

namespace alidade {
namespace {

using namespace testing;

// The transmitter is 3 m north of the receiver and 4 m above it. The receiver moves away from it at
// 0.6 * 5 m/s, and the transmitter at 0.8 * 10 m/s. The clock drifts by 2 m/s.
TEST(PseudorangeRate, IsTheRateOfTheDistancePlusDrift) {
  const SharedSensor sensor = MakeSensor(PseudorangeRate(0.1), "pseudorange_rate");
  const Blocks roles{{1, 2, 3}, {7, -5, 0}, {2}};
  const double transmitter[6] = {1, 5, 7, 0, 0, 10};
  ExpectSame(Prediction(sensor, roles, transmitter), {13}, 1e-15);
  EXPECT_EQ(NoiseDiagonal(sensor, roles, transmitter), std::vector<double>{0.1});
  ExpectTrueJacobian(sensor, roles, transmitter);
}

TEST(PseudorangeRate, IsNotDefinedAtTheTransmitter) {
  const double transmitter[6] = {1, 2, 3, 0, 0, 10};
  ExpectOutOfDomain(MakeSensor(PseudorangeRate(0.1), "rate"), {{1, 2, 3}, {7, -5, 0}, {2}},
                    transmitter);
}

TEST(PseudorangeRate, OwnsTheClockDrift) {
  const OwnedRole drift = MakeSensor(PseudorangeRate(0.1), "rate")->owned(2);
  EXPECT_EQ(drift.dynamics, OwnedDynamics::kRandomWalk);
  EXPECT_EQ(drift.sqrt_prior, std::vector<double>{1e3});
  EXPECT_EQ(drift.sqrt_density, std::vector<double>{0.1});
}

}  // namespace
}  // namespace alidade
