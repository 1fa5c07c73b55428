// SPDX-License-Identifier: Apache-2.0
//
// Tests the batch and the fixed-lag smoother with a given noise that replaces the noise of the
// models.
#include <cmath>

#include "batch_fixture.h"
#include "support/given_noise.h"

namespace alidade {
namespace {

using testing::FrameAt;

/// Returns a problem with a held acceleration of 0.7 m/s^2 and a sensor noise of 0.3 m. If `given`
/// is true, the models have other noises, and given noises of these sizes replace them.
Problem HeldNoise(bool given) {
  Problem problem = testing::HeldPoint(given ? 5.0 : 0.7);
  if (given) {
    problem.motions[0].model = testing::MotionOfNoise(ConstantVelocity<1, false>(5.0), {0.7});
  }
  testing::AddSensor(problem, "z",
                     given ? testing::SensorOfNoise(testing::Linear(2.0, 4.0), {0.3})
                           : testing::LinearSensor(2.0, 0.3),
                     {"p.x"});
  return problem;
}

TEST(CeresBatchGivenNoise, IsTakenInPlaceOfTheModels) {
  for (const char* options : {"", "mode: filtering\n"}) {
    const auto own = testing::MakeBatch(HeldNoise(false), options);
    const auto given = testing::MakeBatch(HeldNoise(true), options);
    std::vector<State> expected, found;
    for (int k = 0; k < 12; ++k) {
      const Frame frame =
          FrameAt(0.1 * k, {{0, 2.0 * std::cos(0.1 * k) + 0.3 * std::sin(37.0 * k)}});
      own->Process(frame);
      given->Process(frame);
      if (own->offline()) continue;
      expected.push_back(own->state());
      found.push_back(given->state());
    }
    if (own->offline()) {
      own->Smooth([&](std::size_t, const State& s, const UpdateReport&) { expected.push_back(s); });
      given->Smooth([&](std::size_t, const State& s, const UpdateReport&) { found.push_back(s); });
    }
    ASSERT_EQ(found.size(), 12u);
    for (std::size_t k = 0; k < found.size(); ++k) {
      EXPECT_EQ(found[k].values(), expected[k].values()) << options << k;
      EXPECT_EQ(found[k].covariance().Dense(), expected[k].covariance().Dense()) << options << k;
    }
  }
}

}  // namespace
}  // namespace alidade
