// SPDX-License-Identifier: Apache-2.0
//
// Tests the rules for landmarks: initialisation, removal, reused ids, landmarks seen by several
// sensors, delayed initialisation, and Jacobians at the implied state.
#include <gtest/gtest.h>

#include <chrono>
#include <numeric>

#include "support/landmark_models.h"

namespace alidade::testing {
namespace {

/// Returns the problem with a second sensor, which comes first. The second sensor measures its
/// landmarks on the same stream.
Problem WithTwoSensors(Problem problem) {
  SensorBinding second = problem.sensors[0];
  second.name = "second";
  problem.sensors.insert(problem.sensors.begin(), second);
  return problem;
}

TEST(Landmarks, EnterWithTheObservationThatIsAskedFor) {
  LandmarkOptions options;
  options.min_observations = 3;
  Ekf ekf = EkfOf(MapSystem(Offset(0.1), options));
  const auto outcome = [&](double t_s) {
    return OutcomeFor(ekf.Process(FrameOf(t_s, {{5, {0, 0, 1}}})), 5);
  };
  EXPECT_EQ(outcome(0.0), Outcome::kNotReady);
  EXPECT_EQ(outcome(0.1), Outcome::kNotReady);
  EXPECT_EQ(outcome(0.2), Outcome::kInitialised);
  EXPECT_EQ(outcome(0.3), Outcome::kAccepted);
}

TEST(Landmarks, ThatTakeThePriorMayWaitForMoreObservations) {
  LandmarkOptions options = WithPrior();
  const auto enters = [&options](const auto& sensor, const std::vector<double>& z) {
    Ekf ekf = EkfOf(MapSystem(sensor, options));
    for (int observation = 1; observation < 9; ++observation) {
      const Frame frame = FrameOf(0.1 * observation, {{5, z}});
      if (OutcomeFor(ekf.Process(frame), 5) == Outcome::kInitialised) return observation;
    }
    return 9;
  };
  options.min_observations = 2;
  EXPECT_EQ(enters(InverseDepthPixels(0.01), {0.1, 0.2}), 2);
  options.prior->min_observations = 4;
  EXPECT_EQ(enters(InverseDepthPixels(0.01), {0.1, 0.2}), 4);
  EXPECT_EQ(enters(Offset(0.1), {0, 0, 1}), 2);
}

TEST(Landmarks, PartsOfTheirFramesAreTimed) {
  const auto frames = [](Problem problem) {
    Ekf ekf = EkfOf(std::move(problem));
    ekf.Process(FrameOf(0.0, {{5, {0, 0, 1}}}));
    const auto started = std::chrono::steady_clock::now();
    const auto spent_s = ekf.Process(FrameOf(0.1, {{5, {0, 0, 1}}, {6, {0, 1, 1}}})).spent_s;
    const std::chrono::duration<double> all = std::chrono::steady_clock::now() - started;
    EXPECT_LE(std::accumulate(spent_s.begin(), spent_s.end(), 0.0), all.count());
    return spent_s;
  };
  for (const double part_s : frames(MapSystem(Offset(0.1), LandmarkOptions()))) {
    EXPECT_GT(part_s, 0.0);
  }
}

TEST(Landmarks, EnterOnlyBelowTheNumberToKeep) {
  LandmarkOptions options;
  options.max_per_frame = 2;
  Ekf ekf = EkfOf(MapSystem(Offset(0.1), options));
  const Frame three = FrameOf(0.0, {{1, {0, 0, 1}}, {2, {0, 1, 1}}, {3, {1, 0, 1}}});
  EXPECT_EQ(ekf.Process(three).landmarks.initialised, 2);
  EXPECT_EQ(OutcomeFor(ekf.Process(three), 3), Outcome::kNotReady);
  // The next frame measures only one of the two landmarks, so another landmark can be initialised.
  EXPECT_EQ(OutcomeFor(ekf.Process(FrameOf(0.1, {{1, {0, 0, 1}}, {3, {1, 0, 1}}})), 3),
            Outcome::kInitialised);
}

TEST(Landmarks, ThatHaveToWaitTakeNoMemory) {
  LandmarkOptions options;
  options.max_per_frame = 2;
  Ekf ekf = EkfOf(MapSystem(Offset(0.1), options));
  std::vector<Observation> many;
  for (int id = 0; id < 200; ++id) many.push_back({id, {0.01 * id, 0, 1}});
  EXPECT_EQ(ekf.Process(FrameOf(0.0, many)).landmarks.initialised, 2);
  const Covariance& p = ekf.state().covariance();
  EXPECT_LE(p.lower().outerStride(), 2 * p.size());
}

// Tests fault 39 of tests/faults/README.md.
TEST(Landmarks, AnIdThatComesBackIsTheNextGeneration) {
  LandmarkOptions options;
  options.max_missed_frames = 2;
  Ekf ekf = EkfOf(MapSystem(Offset(0.1), options));
  ekf.Process(FrameOf(0.0, {{1, {0, 0, 1}}, {2, {0, 1, 1}}}));
  for (int k = 1; k < 4; ++k) ekf.Process(FrameOf(0.1 * k, {{2, {0, 1, 1}}}));
  EXPECT_EQ(ekf.landmarks().size(), 1u);
  EXPECT_EQ(OutcomeFor(ekf.Process(FrameOf(0.5, {{1, {5, 0, 1}}})), 1), Outcome::kInitialised);
  const LandmarkEstimate again = *Find(ekf.landmarks(), 1);
  EXPECT_EQ(again.generation, 1);
  EXPECT_EQ(again.first, TimestampFromSeconds(0.5));
  EXPECT_NEAR(again.position[0], 5.0, 0.5);
  EXPECT_EQ(Find(ekf.landmarks(), 2)->generation, 0);
}

// The report of a removed landmark contains the estimate that a filter without removal has at the
// same time.
TEST(Landmarks, ThatAreRemovedAreReportedAsTheyWere) {
  LandmarkOptions options = WithPrior();
  Ekf keeps = EkfOf(MapSystem(InverseDepthPixels(0.01), options, 0.1));
  options.max_missed_frames = 2;
  Ekf prunes = EkfOf(MapSystem(InverseDepthPixels(0.01), options, 0.1));
  const auto both = [&](const Frame& frame) {
    keeps.Process(frame);
    return prunes.Process(frame).removed_landmarks;
  };
  EXPECT_TRUE(both(FrameOf(0.0, {{1, {0.1, 0.2}}, {2, {-0.1, 0.3}}})).empty());
  EXPECT_TRUE(both(FrameOf(0.1, {{1, {0.12, 0.2}}, {2, {-0.1, 0.29}}})).empty());
  EXPECT_TRUE(both(FrameOf(0.2, {{2, {-0.11, 0.3}}})).empty());
  const std::vector<LandmarkEstimate> removed = both(FrameOf(0.3, {{2, {-0.12, 0.3}}}));
  ASSERT_EQ(removed.size(), 1u);
  const LandmarkEstimate& one = removed[0];
  EXPECT_EQ(one.id, 1);
  EXPECT_EQ(one.removed, TimestampFromSeconds(0.3));
  EXPECT_EQ(one.first, TimestampFromSeconds(0.0));
  EXPECT_EQ(one.last, TimestampFromSeconds(0.1));
  EXPECT_EQ(one.tried, 1);
  const std::vector<LandmarkEstimate> map = keeps.landmarks();
  const LandmarkEstimate* const kept = Find(map, 1);
  ASSERT_NE(kept, nullptr);
  EXPECT_EQ(kept->removed, kNoTimestamp);
  EXPECT_EQ(one.position, kept->position);
  EXPECT_EQ(one.covariance, kept->covariance);
  EXPECT_GT(one.covariance(2, 2), 0.0);
  EXPECT_EQ(one.inverse_distance, kept->inverse_distance);
  EXPECT_EQ(one.sigma, kept->sigma);
  EXPECT_TRUE(both(FrameOf(0.4, {{2, {-0.12, 0.3}}})).empty());  // each removal is reported once
}

TEST(Landmarks, ThatFailTooOftenAreForgotten) {
  LandmarkOptions options;
  options.min_match_ratio = 0.5;
  options.min_attempts = 4;
  EkfOptions gated;
  gated.gate = 0.99;
  Ekf ekf = EkfOf(MapSystem(Offset(0.01), options), gated);
  const std::vector<double> good = {0, 0, 1};
  ekf.Process(FrameOf(0.0, {{1, good}, {2, good}}));
  int deleted = 0;
  for (int k = 1; k <= 4; ++k) {
    EXPECT_EQ(deleted, 0);
    deleted = ekf.Process(FrameOf(0.01 * k, {{1, good}, {2, {9, 9, 9}}})).landmarks.deleted;
  }
  EXPECT_EQ(deleted, 1);
  EXPECT_EQ(ekf.landmarks().size(), 1u);
  EXPECT_EQ(ekf.landmarks()[0].accepted, 4);
}

// Tests fault 83 of tests/faults/README.md.
TEST(Landmarks, OfNegativeDepthAreCountedAndDeletedWhereAsked) {
  using enum LandmarkOptions::NegativeDepth;
  for (const auto policy : {kKeep, kDelete}) {
    LandmarkOptions options = WithPrior(0.05, 0.5);
    options.negative_depth = policy;
    options.known = {{1, {0.0, 0.0, 2.0}, 0.0}, {2, {1.0, 0.0, 2.0}, 0.0}};
    Ekf ekf = EkfOf(MapSystem(InverseDepthPixels(0.001), options));
    LandmarkCounts counts;
    for (int k = 0; k < 6; ++k) {
      // The camera moves right. The image of landmark 7 also moves right, so the inverse depth of
      // this landmark is negative. The predicted pixel does not move, so the first step gives no
      // information on the depth: H = rho (a - r) + m.
      const double x = 0.1 * k;
      const UpdateReport& report = ekf.Process(FrameOf(
          0.1 * k, {{1, {-x / 2.0, 0.0}}, {2, {(1.0 - x) / 2.0, 0.0}}, {7, {0.02 * k, 0.0}}}));
      counts.negative += report.landmarks.negative;
      counts.deleted += report.landmarks.deleted;
    }
    const bool keeps = policy == kKeep;
    EXPECT_EQ(counts.negative, keeps ? 1 : 2);  // the landmark is deleted and initialised again
    EXPECT_EQ(counts.deleted, keeps ? 0 : 2);
    if (keeps) {
      EXPECT_NEAR(Find(ekf.landmarks(), 7)->inverse_distance, -0.2, 0.05);
    }
  }
}

/// Measures a position directly.
struct Gps : Sensor<Vec<3>, Vec<3>> {
  static constexpr std::array kRoles{Quantity{"position", "m", "", "x,y,z"}};
  static constexpr Quantity kMeasurement{"fix", "m", "", "x,y,z"};
  static constexpr int kInitialises = 0;
  template <class T>
  bool Predict(const T* position, T* z) const {
    for (int i = 0; i < 3; ++i) z[i] = position[i];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    for (int i = 0; i < 3; ++i) l[4 * i] = T(1.0);
  }
  template <class T>
  bool Initialise(const T* z, T* position) const {
    for (int i = 0; i < 3; ++i) position[i] = z[i];
    return true;
  }
};

TEST(Landmarks, OfASensorThatWaitsForABlockDoNotEnter) {
  Problem problem = WithTwoSensors(MapSystem(Offset(0.1), {}, 0.3));
  const SharedMotion walk = MakeMotion(Walk(0.1), "walk");
  const BlockId waits = problem.layout.Declare("other.position", "other", walk->blocks()[0]);
  problem.motions.push_back({"other", walk, {waits}});
  Prior prior;
  prior.block = waits;
  prior.sensor = "gps";
  problem.priors.push_back(prior);
  problem.sensors[0].roles[0].block = waits;
  problem.AddSensor("gps", Gps(), {waits});  // the frame has no measurement of this sensor
  Ekf ekf(problem, {}, {{"tracks", 3}});
  const UpdateReport& report = ekf.Process(FrameOf(0.0, {{5, {0, 0, 1}}}));
  ASSERT_EQ(report.measurements().size(), 2u);
  EXPECT_EQ(report.measurements()[0].outcome, Outcome::kNotReady);
  EXPECT_EQ(report.measurements()[1].outcome, Outcome::kInitialised);
}

/// Measures z = (p - r)^3, element by element. z determines r if p is known.
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
  Problem problem = MapSystem(Cubes(), options, 1.0);
  problem.sensors[0].roles[0].jacobian_at = JacobianAt::kMeasurement;
  Ekf ekf(problem, {}, {{"tracks", 3}});
  const double z = 1.5 * 1.5 * 1.5;  // z implies r = 0.5, so H = -3 1.5^2
  const UpdateReport& report = ekf.Process(FrameOf(0.0, {{1, {z, z, z}}}));
  EXPECT_NEAR(report.measurements()[0].s[0], 6.75 * 6.75 + 1e-6, 1e-9);
}

TEST(Landmarks, ToKeepAreCountedOnceWhereTwoSensorsSeeThem) {
  LandmarkOptions options;
  options.max_per_frame = 3;
  const Problem problem = WithTwoSensors(MapSystem(Offset(0.1), options, 0.3));
  Ekf ekf(problem, {}, {{"tracks", 3}});
  ekf.Process(FrameOf(0.0, {{1, {0, 0, 1}}, {2, {0, 1, 1}}}));
  ekf.Process(FrameOf(0.1, {{1, {0, 0, 1}}, {2, {0, 1, 1}}, {3, {1, 0, 1}}, {4, {1, 1, 1}}}));
  EXPECT_EQ(ekf.landmarks().size(), 3u);
}

TEST(Landmarks, CountOnceForThePriorWhereTwoSensorsSeeThem) {
  LandmarkOptions options = WithPrior(1.0, 0.5);
  options.prior->adapt_after = 3;
  options.known = {{1, {0.0, 0.0, 2.0}, 0.1}, {2, {0.0, 0.1, 4.0}, 0.1}};
  const Problem problem = WithTwoSensors(MapSystem(InverseDepthPixels(0.01), options));
  Ekf ekf(problem, {}, {{"tracks", 2}});
  ekf.Process(FrameOf(0.0, {{1, {0, 0}}, {2, {0, 0.025}}, {7, {0.1, 0.1}}}));
  const std::vector<LandmarkEstimate> landmarks = ekf.landmarks();
  ASSERT_NE(Find(landmarks, 7), nullptr);
  EXPECT_EQ(Find(landmarks, 7)->inverse_distance, 1.0);  // two landmarks have converged, not four
}

TEST(Landmarks, NeedAPriorWithBothNumbers) {
  LandmarkOptions options;
  options.prior.emplace();  // neither number of the prior has a default
  EXPECT_THROW(EkfOf(MapSystem(InverseDepthPixels(0.01), options)), ContractViolation);
  options.prior->inverse_distance = 1.0;
  EXPECT_THROW(EkfOf(MapSystem(InverseDepthPixels(0.01), options)), ContractViolation);
  options.prior->sigma = 0.5;
  EXPECT_NO_THROW(EkfOf(MapSystem(InverseDepthPixels(0.01), options)));
}

TEST(Landmarks, ThatHaveNotConvergedAreNoPrior) {
  LandmarkOptions options = WithPrior(1.0, 0.5);
  options.prior->adapt_after = 2;
  Ekf ekf(MapSystem(InverseDepthPixels(0.01), options), {}, {{"tracks", 2}});
  ekf.Process(FrameOf(0.0, {{1, {0, 0}}, {2, {0, 0.1}}, {3, {0.1, 0}}}));
  ekf.Process(FrameOf(0.1, {{1, {0.05, 0}}, {2, {0.05, 0.1}}, {3, {0.15, 0}}}));
  ekf.Process(FrameOf(0.2, {{1, {0.05, 0}}, {2, {0.05, 0.1}}, {3, {0.2, 0}}, {8, {0.1, 0.1}}}));
  const std::vector<LandmarkEstimate> landmarks = ekf.landmarks();
  ASSERT_NE(Find(landmarks, 1), nullptr);
  ASSERT_NE(Find(landmarks, 1)->inverse_distance, 1.0);
  EXPECT_EQ(Find(landmarks, 8)->inverse_distance, 1.0);
}

TEST(Landmarks, AreNotCorrelatedWithWhatTheirSensorHolds) {
  Problem problem = MapSystem(Offset(0.1), {}, 0.3);
  problem.sensors[0].roles[0].mode = RoleMode::kKnown;
  Ekf ekf(problem, {}, {{"tracks", 3}});
  ekf.Process(FrameOf(0.0, {{1, {0, 0, 1}}}));
  // The variance consists of R only. With the uncertainty of the camera it would be 0.1^2 + 0.3^2.
  EXPECT_NEAR(ekf.landmarks().at(0).covariance(0, 0), 0.01, 1e-12);
}

TEST(Landmarks, ThatWaitToEnterAreCountedAnewAfterThirtyFramesWithout) {
  LandmarkOptions options;
  options.min_observations = 2;
  Ekf ekf(MapSystem(Offset(0.1), options, 0.3), {}, {{"tracks", 3}});
  const auto enters = [&ekf](int frames_without) {
    ekf.Process(FrameOf(0.0, {{1, {0, 0, 1}}}));
    for (int k = 0; k < frames_without; ++k) ekf.Process(FrameOf(0.0, {{2, {1, 1, 1}}}));
    ekf.Process(FrameOf(0.0, {{1, {0, 0, 1}}}));
    return Find(ekf.landmarks(), 1) != nullptr;
  };
  EXPECT_FALSE(enters(30));
  EXPECT_TRUE(enters(28));
}

TEST(Landmarks, GoBackToTheGenerationsOfTheirPast) {
  LandmarkOptions options;
  options.max_missed_frames = 1;
  Ekf ekf(MapSystem(Offset(0.1), options, 0.3), {}, {{"tracks", 3}});
  const auto see = [&ekf](std::int64_t id) {
    ekf.Process(FrameOf(0.0, {{id, {0, 0, 1}}}));
    return Find(ekf.landmarks(), id)->generation;
  };
  EXPECT_EQ(see(1), 0);
  EXPECT_EQ(see(2), 0);  // this frame prunes landmark 1
  EXPECT_EQ(see(1), 1);
  const Ekf saved = ekf;
  EXPECT_EQ(see(2), 1);
  EXPECT_EQ(see(1), 2);
  ekf = saved;
  EXPECT_EQ(see(2), 1);
  EXPECT_EQ(see(3), 0);
  EXPECT_EQ(see(1), 2);
  EXPECT_EQ(see(2), 2);
}

/// A Walk whose process noise is constant from one update to the next.
struct HeldWalk : Walk {
  using Walk::Walk;
  NoiseKind noise_kind() const { return NoiseKind::kDiscrete; }
};

// At 0.1 s only a landmark that is not yet initialised is measured, so the noise interval lasts
// until 0.2 s. The pruning of another landmark at 0.1 s does not change this interval.
TEST(Landmarks, ThatArePrunedDoNotEndAnIntervalOfHeldNoise) {
  const auto camera = [](int max_missed_frames) {
    LandmarkOptions options;
    options.min_observations = 2;
    options.max_missed_frames = max_missed_frames;
    Problem problem = MapSystem(Offset(0.1), options, 0.3);
    problem.motions[0].model = MakeMotion(HeldWalk(0.1), "held_walk");
    Ekf ekf(problem, {}, {{"tracks", 3}});
    for (int i = 0; i < 2; ++i) ekf.Process(FrameOf(0.0, {{1, {0, 0, 1}}}));
    EXPECT_EQ(ekf.landmarks().size(), 1u);
    ekf.Process(FrameOf(0.1, {{2, {0, 0, 1}}}));
    EXPECT_EQ(ekf.landmarks().size(), max_missed_frames == 0 ? 1u : 0u);
    ekf.Process(FrameOf(0.2, {}));
    return ekf.state().covariance().Variance(0);
  };
  EXPECT_DOUBLE_EQ(camera(1), camera(0));
  // The noise is constant over the interval, so two steps add 2 sigma sqrt(dt) w.
  EXPECT_NEAR(camera(0), 0.3 * 0.3 + 4.0 * 0.1 * 0.1 * 0.1, 1e-12);
}

TEST(Landmarks, WhoseFirstEndIsGoneBackOverAreTheFirstOfTheirId) {
  LandmarkOptions options;
  options.max_missed_frames = 1;
  Ekf ekf(MapSystem(Offset(0.1), options, 0.3), {}, {{"tracks", 3}});
  const auto see = [&ekf](std::int64_t id) {
    ekf.Process(FrameOf(0.0, {{id, {0, 0, 1}}}));
    return Find(ekf.landmarks(), id)->generation;
  };
  const Ekf saved = ekf;
  EXPECT_EQ(see(5), 0);
  EXPECT_EQ(see(6), 0);  // this frame prunes landmark 5
  ekf = saved;
  EXPECT_EQ(see(5), 0);
}

}  // namespace
}  // namespace alidade::testing
