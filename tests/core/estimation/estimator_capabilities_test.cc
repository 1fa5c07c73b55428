// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/estimator_capabilities.h"

#include <gtest/gtest.h>

#include "alidade/estimation/iekf.h"
#include "alidade/estimation/rts.h"
#include "alidade/estimation/square_root_ekf.h"
#include "alidade/estimation/ukf.h"
#include "support/systems.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

Problem WithAConsideredBlock() {
  return WithStatus(DepthFilter(), "template.inverse_distance", BlockStatus::kConsider);
}

Problem WithABlockFromAMeasurement() {
  Problem problem = DepthFilter();
  problem.priors[0].sensor = "disparity";
  return problem;
}

Problem WithARole(RoleMode mode, JacobianAt at) {
  Problem problem = DepthFilter();
  problem.sensors[1].roles[1].mode = mode;
  problem.sensors[1].roles[1].jacobian_at = at;
  return problem;
}

Problem WithALoss() {
  Problem problem = DepthFilter();
  problem.sensors[1].loss = {LossKind::kHuber, 1.345};
  return problem;
}

Problem WithLandmarks() {
  Problem problem = DepthFilter();
  problem.landmarks.emplace();
  return problem;
}

TEST(EstimatorCapabilities, NamesTheFirstThingThatIsLacking) {
  const EstimatorCapabilities nothing = {.known = false};
  EXPECT_FALSE(FindUnsupported(DepthFilter(), nothing));
  const auto expect = [&](const Problem& problem, const EstimatorCapabilities& enough,
                          const char* what, int block, int sensor, int role) {
    const auto found = FindUnsupported(problem, nothing);
    ASSERT_TRUE(found) << what;
    EXPECT_EQ(found->description, what);
    EXPECT_EQ(found->block, block) << what;
    EXPECT_EQ(found->sensor, sensor) << what;
    EXPECT_EQ(found->role, role) << what;
    EXPECT_FALSE(FindUnsupported(problem, enough)) << what;
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
bool Makes(const Problem& problem) {
  try {
    Filter(problem, {}, StreamsOf(problem));
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(" does not support "), std::string::npos);
    return false;
  }
  return true;
}

/// Expects that Filter accepts exactly those problems that its kCapabilities allow.
template <class Filter>
void ExpectAsSupported() {
  const EstimatorCapabilities& can = Filter::kCapabilities;
  EXPECT_EQ(Makes<Filter>(WithAConsideredBlock()), can.consider);
  EXPECT_EQ(Makes<Filter>(WithABlockFromAMeasurement()), can.from_measurement);
  EXPECT_EQ(Makes<Filter>(WithARole(RoleMode::kConsider, JacobianAt::kPrediction)), can.consider);
  EXPECT_EQ(Makes<Filter>(WithARole(RoleMode::kKnown, JacobianAt::kPrediction)), can.known);
  EXPECT_EQ(Makes<Filter>(WithARole(RoleMode::kEstimate, JacobianAt::kMeasurement)),
            can.at_measurement);
  EXPECT_TRUE(Makes<Filter>(WithALoss()));
  EXPECT_EQ(Makes<Filter>(WithLandmarks()), can.landmarks);
}

TEST(EstimatorCapabilities, IsWhatTheConstructorsTake) {
  ExpectAsSupported<Ekf>();
  ExpectAsSupported<Iekf>();
  ExpectAsSupported<SquareRootEkf>();
  ExpectAsSupported<Ukf>();
  ExpectAsSupported<RtsSmoother>();
}

}  // namespace
}  // namespace alidade
