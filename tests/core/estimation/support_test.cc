// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/support.h"

#include <gtest/gtest.h>

#include "alidade/estimation/iekf.h"
#include "alidade/estimation/rts.h"
#include "alidade/estimation/square_root_ekf.h"
#include "alidade/estimation/ukf.h"
#include "support/systems.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

System WithAConsideredBlock() {
  return WithStatus(DepthFilter(), "template.inverse_distance", BlockStatus::kConsider);
}

System WithABlockFromAMeasurement() {
  System system = DepthFilter();
  system.priors[0].from = "stereo";
  return system;
}

System WithARole(RoleMode mode, JacobianAt at) {
  System system = DepthFilter();
  system.sensors[1].roles[1].mode = mode;
  system.sensors[1].roles[1].jacobian_at = at;
  return system;
}

System WithALoss() {
  System system = DepthFilter();
  system.sensors[1].loss = {LossKind::kHuber, 1.345};
  return system;
}

System WithLandmarks() {
  System system = DepthFilter();
  system.landmarks.emplace();
  return system;
}

TEST(Support, NamesTheFirstThingThatIsLacking) {
  const Support nothing = {.known = false};
  EXPECT_FALSE(FindUnsupported(DepthFilter(), nothing));
  const auto expect = [&](const System& system, const Support& enough, const char* what, int block,
                          int sensor, int role) {
    const auto found = FindUnsupported(system, nothing);
    ASSERT_TRUE(found) << what;
    EXPECT_EQ(found->what, what);
    EXPECT_EQ(found->block, block) << what;
    EXPECT_EQ(found->sensor, sensor) << what;
    EXPECT_EQ(found->role, role) << what;
    EXPECT_FALSE(FindUnsupported(system, enough)) << what;
  };
  expect(WithAConsideredBlock(), {.consider = true, .known = false}, "consider blocks", 2, -1, -1);
  expect(WithABlockFromAMeasurement(), {.from_measurement = true},
         "blocks that start from a measurement", 0, -1, -1);
  expect(WithARole(RoleMode::kConsider, JacobianAt::kPrediction), {.consider = true},
         "consider roles", -1, 1, 1);
  expect(WithARole(RoleMode::kKnown, JacobianAt::kPrediction), {}, "known roles", -1, 1, 1);
  expect(WithARole(RoleMode::kEstimate, JacobianAt::kMeasurement), {.at_measurement = true},
         "jacobian_at: measurement", -1, 1, 1);
  expect(WithLandmarks(), {.landmarks = true}, "landmarks", -1, -1, -1);
}

template <class Filter>
bool Makes(const System& system) {
  try {
    Filter(system, {}, StreamsOf(system));
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(" does not support "), std::string::npos);
    return false;
  }
  return true;
}

/// Whether the filter is made from exactly the systems that its kSupport allows.
template <class Filter>
void ExpectAsSupported() {
  const Support& can = Filter::kSupport;
  EXPECT_EQ(Makes<Filter>(WithAConsideredBlock()), can.consider);
  EXPECT_EQ(Makes<Filter>(WithABlockFromAMeasurement()), can.from_measurement);
  EXPECT_EQ(Makes<Filter>(WithARole(RoleMode::kConsider, JacobianAt::kPrediction)), can.consider);
  EXPECT_EQ(Makes<Filter>(WithARole(RoleMode::kKnown, JacobianAt::kPrediction)), can.known);
  EXPECT_EQ(Makes<Filter>(WithARole(RoleMode::kEstimate, JacobianAt::kMeasurement)),
            can.at_measurement);
  EXPECT_TRUE(Makes<Filter>(WithALoss()));
  EXPECT_EQ(Makes<Filter>(WithLandmarks()), can.landmarks);
}

TEST(Support, IsWhatTheConstructorsTake) {
  ExpectAsSupported<Ekf>();
  ExpectAsSupported<Iekf>();
  ExpectAsSupported<SquareRootEkf>();
  ExpectAsSupported<Ukf>();
  ExpectAsSupported<RtsSmoother>();
}

}  // namespace
}  // namespace alidade
