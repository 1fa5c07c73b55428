// SPDX-License-Identifier: Apache-2.0
//
// Landmarks where sensors share them, wait, or are linearised elsewhere, and ids that come back.
#include <gtest/gtest.h>

#include <algorithm>

#include "support/landmark_models.h"

namespace alidade::testing {
namespace {

/// The system with a second sensor of its landmarks, first in order, on the same stream.
System WithTwoSensors(System system) {
  SensorBinding second = system.sensors[0];
  second.name = "second";
  system.sensors.insert(system.sensors.begin(), second);
  return system;
}

const LandmarkEstimate* Find(const std::vector<LandmarkEstimate>& landmarks, std::int64_t id) {
  const auto found = std::ranges::find(landmarks, id, &LandmarkEstimate::id);
  return found == landmarks.end() ? nullptr : &*found;
}

TEST(Landmarks, OfASensorThatWaitsForABlockDoNotEnter) {
  System system = WithTwoSensors(MapSystem(Offset(0.1), {}, 0.3));
  const MotionModel walk = InProcessMotion(Walk(0.1), "walk");
  const BlockId waits = system.layout.Declare("other.position", "other", walk.blocks()[0]);
  system.motions.push_back({"other", walk, {waits}});
  Prior prior;
  prior.block = waits;
  prior.from = "gps";
  system.priors.push_back(prior);
  system.sensors[0].roles[0].block = waits;
  Ekf ekf(system, {}, {{"tracks", 3}});
  const UpdateReport& report = ekf.Process(Sights(0.0, {{5, {0, 0, 1}}}));
  ASSERT_EQ(report.measurements().size(), 2u);
  EXPECT_EQ(report.measurements()[0].outcome, Outcome::kNotReady);
  EXPECT_EQ(report.measurements()[1].outcome, Outcome::kInitialised);
}

/// z = (p - r)^3, element by element, which tells r where p is known.
struct Cubes : Sensor<Vec<3>, Vec<3>, Vec<3>> {
  static constexpr std::array kRoles{kPosition,
                                     Quantity{"landmark", "m", "", "x,y,z", kOfLandmark}};
  static constexpr Quantity kMeasurement{"cubes", "m^3", "", "x,y,z"};
  static constexpr int kInitialises = 0;
  template <class T>
  bool Predict(const T* r, const T* p, T* z) const {
    for (int i = 0; i < 3; ++i) z[i] = (p[i] - r[i]) * (p[i] - r[i]) * (p[i] - r[i]);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    for (int i = 0; i < 3; ++i) l[4 * i] = T(1e-3);
  }
  template <class T>
  bool Initialise(const T* p, const T* z, T* r) const {
    using std::pow;
    for (int i = 0; i < 3; ++i) r[i] = p[i] - pow(z[i], 1.0 / 3.0);
    return true;
  }
};

TEST(Landmarks, AreLinearisedAtTheMeasurementWhereARoleIs) {
  LandmarkOptions options;
  options.known = {{1, {2.0, 2.0, 2.0}, 0.0}};
  System system = MapSystem(Cubes(), options, 1.0);
  system.sensors[0].roles[0].linearise_at = LineariseAt::kMeasurement;
  Ekf ekf(system, {}, {{"tracks", 3}});
  const double z = 1.5 * 1.5 * 1.5;  // r = 0.5, where H = -3 1.5^2
  const UpdateReport& report = ekf.Process(Sights(0.0, {{1, {z, z, z}}}));
  EXPECT_NEAR(report.measurements()[0].s.at(0), 6.75 * 6.75 + 1e-6, 1e-9);
}

TEST(Landmarks, ToKeepAreCountedOnceWhereTwoSensorsSeeThem) {
  LandmarkOptions options;
  options.keep = 3;
  const System system = WithTwoSensors(MapSystem(Offset(0.1), options, 0.3));
  Ekf ekf(system, {}, {{"tracks", 3}});
  ekf.Process(Sights(0.0, {{1, {0, 0, 1}}, {2, {0, 1, 1}}}));
  ekf.Process(Sights(0.1, {{1, {0, 0, 1}}, {2, {0, 1, 1}}, {3, {1, 0, 1}}, {4, {1, 1, 1}}}));
  EXPECT_EQ(ekf.landmarks().size(), 3u);
}

TEST(Landmarks, CountOnceForThePriorWhereTwoSensorsSeeThem) {
  LandmarkOptions options = WithPrior(1.0, 0.5);
  options.prior->from_map = 3;
  options.known = {{1, {0.0, 0.0, 2.0}, 0.1}, {2, {0.0, 0.1, 4.0}, 0.1}};
  const System system = WithTwoSensors(MapSystem(InverseDepthPixels(0.01), options));
  Ekf ekf(system, {}, {{"tracks", 2}});
  ekf.Process(Sights(0.0, {{1, {0, 0}}, {2, {0, 0.025}}, {7, {0.1, 0.1}}}));
  const std::vector<LandmarkEstimate> landmarks = ekf.landmarks();
  ASSERT_NE(Find(landmarks, 7), nullptr);
  EXPECT_EQ(Find(landmarks, 7)->inverse_distance, 1.0);  // two have converged, not four
}

TEST(Landmarks, ThatHaveNotConvergedAreNoPrior) {
  LandmarkOptions options = WithPrior(1.0, 0.5);
  options.prior->from_map = 2;
  Ekf ekf(MapSystem(InverseDepthPixels(0.01), options), {}, {{"tracks", 2}});
  ekf.Process(Sights(0.0, {{1, {0, 0}}, {2, {0, 0.1}}, {3, {0.1, 0}}}));
  ekf.Process(Sights(0.1, {{1, {0.05, 0}}, {2, {0.05, 0.1}}, {3, {0.15, 0}}}));
  ekf.Process(Sights(0.2, {{1, {0.05, 0}}, {2, {0.05, 0.1}}, {3, {0.2, 0}}, {8, {0.1, 0.1}}}));
  const std::vector<LandmarkEstimate> landmarks = ekf.landmarks();
  ASSERT_NE(Find(landmarks, 1), nullptr);
  ASSERT_NE(Find(landmarks, 1)->inverse_distance, 1.0);
  EXPECT_EQ(Find(landmarks, 8)->inverse_distance, 1.0);
}

TEST(Landmarks, AreNotCorrelatedWithWhatTheirSensorHolds) {
  System system = MapSystem(Offset(0.1), {}, 0.3);
  system.sensors[0].roles[0].mode = RoleMode::kHold;
  Ekf ekf(system, {}, {{"tracks", 3}});
  ekf.Process(Sights(0.0, {{1, {0, 0, 1}}}));
  // R alone; with the camera's own uncertainty it would be 0.1^2 + 0.3^2
  EXPECT_NEAR(ekf.landmarks().at(0).covariance(0, 0), 0.01, 1e-12);
}

TEST(Landmarks, ThatWaitToEnterAreCountedAnewAfterThirtyFramesWithout) {
  LandmarkOptions options;
  options.enter_after = 2;
  Ekf ekf(MapSystem(Offset(0.1), options, 0.3), {}, {{"tracks", 3}});
  const auto enters = [&ekf](int frames_without) {
    ekf.Process(Sights(0.0, {{1, {0, 0, 1}}}));
    for (int k = 0; k < frames_without; ++k) ekf.Process(Sights(0.0, {{2, {1, 1, 1}}}));
    ekf.Process(Sights(0.0, {{1, {0, 0, 1}}}));
    return Find(ekf.landmarks(), 1) != nullptr;
  };
  EXPECT_FALSE(enters(30));
  EXPECT_TRUE(enters(28));
}

TEST(Landmarks, GoBackToTheGenerationsOfTheirPast) {
  LandmarkOptions options;
  options.unseen_frames = 1;
  Ekf ekf(MapSystem(Offset(0.1), options, 0.3), {}, {{"tracks", 3}});
  const auto see = [&ekf](std::int64_t id) {
    ekf.Process(Sights(0.0, {{id, {0, 0, 1}}}));
    return Find(ekf.landmarks(), id)->generation;
  };
  EXPECT_EQ(see(1), 0);
  EXPECT_EQ(see(2), 0);  // ends 1
  EXPECT_EQ(see(1), 1);
  const auto saved = ekf.Save();
  EXPECT_EQ(see(2), 1);
  EXPECT_EQ(see(1), 2);
  ekf.Restore(*saved);
  EXPECT_EQ(see(2), 1);
  EXPECT_EQ(see(3), 0);
  EXPECT_EQ(see(1), 2);
  EXPECT_EQ(see(2), 2);
}

}  // namespace
}  // namespace alidade::testing
