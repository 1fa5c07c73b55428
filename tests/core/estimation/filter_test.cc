// SPDX-License-Identifier: Apache-2.0
//
// Tests the live use of a filter: measurements added by the name of their sensor, predictions that
// do not change the filter, and copies.
#include "alidade/estimation/filter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <thread>

#include "alidade/base/error.h"
#include "alidade/base/random.h"
#include "alidade/estimation/iekf.h"
#include "alidade/estimation/square_root_ekf.h"
#include "alidade/estimation/ukf.h"
#include "support/landmark_models.h"
#include "support/systems.h"

namespace alidade::testing {
namespace {

template <class Type>
Type MakeLive() {
  const Problem problem = DepthFilter();
  if constexpr (std::is_same_v<Type, Iekf>) {
    return Iekf(problem, IekfOptions{}, StreamsOf(problem));
  } else if constexpr (std::is_same_v<Type, Ukf>) {
    return Ukf(problem, UkfOptions{}, StreamsOf(problem));
  } else {
    return Type(problem, EkfOptions{}, StreamsOf(problem));
  }
}

/// Returns frames of a target that oscillates between 0.2 and 0.4 m. Some frames are empty, and
/// some have only one stream.
std::vector<Frame> Swinging(int count, std::uint64_t seed) {
  Random random(seed);
  std::vector<Frame> frames;
  double t_s = 0.0;
  for (int k = 0; k < count; ++k) {
    t_s += 0.01 + 0.05 * random.Uniform();
    const double depth = 0.3 + 0.1 * std::sin(2.5 * t_s);
    std::vector<std::pair<int, double>> values;
    if (random.Uniform() < 0.6) values.emplace_back(0, 26.0 / depth + random.Normal());
    if (random.Uniform() < 0.6) values.emplace_back(1, depth / 0.3 + 0.003 * random.Normal());
    frames.push_back(FrameAt(t_s, values));
  }
  return frames;
}

void ExpectSame(const State& a, const State& b) {
  EXPECT_EQ(a.values(), b.values());
  EXPECT_EQ(a.covariance().Dense(), b.covariance().Dense());
}

/// Measures the distance to a beacon. The position of the beacon is supplied with the measurement.
struct Beacon : Sensor<Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"x"}};
  static constexpr Quantity kMeasurement{"z"};
  using Known = Vec<1>;
  static constexpr Quantity kKnown{"beacon"};
  template <class T>
  bool Predict(const T* x, const double* beacon, T* z) const {
    z[0] = x[0] - beacon[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const double* beacon, T* l) const {
    l[0] = T(0.1 * beacon[0]);
  }
  bool Valid(const double* beacon, const double*) const { return beacon[0] > 0.0; }
};

// x = 1 +- 2 and z = x - 3 +- 0.3, so S = 4.09 and x' = 1 + 4 / 4.09 (z + 2).
TEST(LiveKnown, ComesWithAReadingAndIsNeededForAPrediction) {
  Problem problem = MovingPoint();
  AddSensor(problem, "z", MakeSensor(Beacon(), "beacon"), {"p.x"});
  Ekf filter(problem, {}, StreamsOf(problem));
  EXPECT_THROW(filter.Push(0, {{0, {-1.5}}}), Error);
  EXPECT_THROW(static_cast<void>(filter.Expect("z", 0)), Error);
  const auto expected = filter.Expect("z", 0, -1, {3.0});
  ASSERT_TRUE(expected);
  EXPECT_DOUBLE_EQ(expected->z[0], -2.0);
  EXPECT_DOUBLE_EQ(expected->s(0, 0), 4.09);
  const UpdateReport& report =
      filter.Push(0, {{0, {-1.5}, -1, {}, {3.0}}, {0, {7.0}, -1, {}, {-3.0}}});
  EXPECT_EQ(report.measurements()[0].outcome, Outcome::kAccepted);
  EXPECT_EQ(report.measurements()[1].outcome, Outcome::kInvalid);
  EXPECT_NEAR(ValueOf(filter.state(), "p.x"), 1.0 + 4.0 / 4.09 * 0.5, 1e-15);
}

template <class Type>
class Live : public ::testing::Test {};
using Recursive = ::testing::Types<Ekf, Iekf, SquareRootEkf, Ukf>;
TYPED_TEST_SUITE(Live, Recursive);

TYPED_TEST(Live, AtIsWhereAFrameWithoutMeasurementsLeads) {
  TypeParam filter = MakeLive<TypeParam>(), run = MakeLive<TypeParam>();
  for (const Frame& frame : Swinging(20, 1)) {
    filter.Process(frame);
    const State before = filter.state();
    const Timestamp later = frame.timestamp + 7'000'000;
    const State at = filter.At(later);
    ExpectSame(filter.state(), before);
    EXPECT_EQ(filter.timestamp(), frame.timestamp);
    run = filter;
    Frame empty;
    empty.timestamp = later;
    run.Process(empty);
    ExpectSame(at, run.state());
    EXPECT_NE(at.covariance().Dense(), before.covariance().Dense());
  }
  ExpectSame(filter.At(0), filter.state());  // At returns the current state for a past time
}

// Runs 250 random sequences for each type of filter.
TYPED_TEST(Live, WhateverIsAskedBetweenTheFramesTheRunIsTheStraightOne) {
  for (std::uint64_t seed = 0; seed < 250; ++seed) {
    const std::vector<Frame> frames = Swinging(12, seed);
    TypeParam straight = MakeLive<TypeParam>();
    std::unique_ptr<Estimator> asked = std::make_unique<TypeParam>(straight);
    Random random(seed + 1'000);
    for (const Frame& frame : frames) {
      straight.Process(frame);
      auto& filter = dynamic_cast<Filter&>(*asked);
      while (random.Uniform() < 0.7) {
        const auto later = static_cast<Timestamp>(1e8 * random.Uniform());
        const double dice = random.Uniform();
        if (dice < 0.3) {
          filter.At(frame.timestamp + later);
        } else if (dice < 0.6) {
          filter.Expect("disparity", frame.timestamp + later);
        } else {
          const auto other = filter.Clone();  // updates a copy, which must not change the filter
          other->Process(FrameAt(Seconds(frame.timestamp + later), {{0, 70.0}}));
        }
      }
      std::vector<Reading> readings;
      for (const Measurement& m : frame.measurements) readings.push_back({m.stream, m.values});
      filter.Push(frame.timestamp, readings);
      if (random.Uniform() < 0.5) asked = asked->Clone();
    }
    ExpectSame(straight.state(), asked->state());
    if (this->HasFailure()) return;
  }
}

TYPED_TEST(Live, ExpectsWhatTheReportThenSaysOfTheMeasurement) {
  TypeParam filter = MakeLive<TypeParam>();
  for (const Frame& frame : Swinging(10, 3)) filter.Process(frame);
  const Timestamp later = filter.timestamp() + 20'000'000;
  const auto disparity = filter.Expect("disparity", later);
  const auto scale = filter.Expect("inverse_scale", later);
  ASSERT_TRUE(disparity && scale);
  const UpdateReport& report = filter.Push(
      later, {{filter.stream("disparity"), {80.0}}, {filter.stream("inverse_scale"), {1.0}}});
  ASSERT_EQ(report.measurements().size(), 2u);
  EXPECT_EQ(disparity->z, report.measurements()[0].h);
  EXPECT_NEAR(disparity->s(0, 0), report.measurements()[0].s[0], 1e-12 * disparity->s(0, 0));
  EXPECT_EQ(scale->z, report.measurements()[1].h);
  EXPECT_NEAR(scale->s(0, 0), report.measurements()[1].s[0], 1e-12 * scale->s(0, 0));
}

TYPED_TEST(Live, ExpectsOfEachLandmarkWhatItExpectsOfItAlone) {
  TypeParam filter = MakeLive<TypeParam>();
  for (const Frame& frame : Swinging(10, 3)) filter.Process(frame);
  const State before = filter.state();
  const Timestamp later = filter.timestamp() + 20'000'000;
  EXPECT_TRUE(filter.ExpectEach("disparity", later, {}).empty());
  const auto each = filter.ExpectEach("disparity", later, {-1, -1});
  const auto alone = filter.Expect("disparity", later);
  ASSERT_EQ(each.size(), 2u);
  for (const auto& one : each) {
    ASSERT_TRUE(one && alone);
    EXPECT_EQ(one->z, alone->z);
    EXPECT_EQ(one->s, alone->s);
  }
  ExpectSame(filter.state(), before);
  EXPECT_THROW(filter.ExpectEach("stereo", later, {-1}), Error);
}

// The expected pixels are computed for the predicted position of the camera. A landmark that is not
// in the map has no expected pixel.
TEST(Live, ExpectsOfEachLandmarkOfTheMapItsOwn) {
  Ekf ekf = EkfOf(MapSystem(InverseDepthPixels(0.01), WithPrior()));
  ekf.Process(FrameOf(0.0, {{3, {0.1, 0.2}}, {8, {-0.3, 0.0}}, {5, {0.0, -0.1}}}));
  ekf.Process(FrameOf(0.1, {{3, {0.11, 0.2}}, {8, {-0.28, 0.0}}, {5, {0.01, -0.1}}}));
  const State before = ekf.state();
  const Timestamp later = ekf.timestamp() + 50'000'000;
  const std::string& sensor = ekf.problem().sensors[0].name;
  const auto each = ekf.ExpectEach(sensor, later, {5, 99, 3, 8, -1});
  ASSERT_EQ(each.size(), 5u);
  EXPECT_FALSE(each[1]);
  EXPECT_FALSE(each[4]);
  for (const auto& [place, id] : {std::pair{0, 5}, {2, 3}, {3, 8}}) {
    const auto& one = each[static_cast<std::size_t>(place)];
    const auto alone = ekf.Expect(sensor, later, id);
    ASSERT_TRUE(one && alone);
    EXPECT_EQ(one->z, alone->z);
    EXPECT_EQ(one->s, alone->s);
  }
  EXPECT_NEAR(each[0]->z[0], 0.01, 0.02);
  EXPECT_NEAR(each[2]->z[1], 0.2, 0.02);
  EXPECT_NEAR(each[3]->z[0], -0.28, 0.02);
  ExpectSame(ekf.state(), before);
}

TEST(Live, NamesAreThoseOfTheConfigAndAWrongOneIsAnErrorThatListsThem) {
  const Ekf ekf = MakeLive<Ekf>();
  EXPECT_EQ(ekf.stream("inverse_scale"), 1);
  EXPECT_EQ(ekf.state().layout()[ekf.block("target.depth")].name, "target.depth");
  const auto text = [](const auto& call) -> std::string {
    try {
      call();
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(text([&] { ekf.stream("disparty"); }),
            "the problem has no stream 'disparty'; expected one of disparity, inverse_scale");
  EXPECT_EQ(text([&] { ekf.block("depth"); }),
            "the problem has no block 'depth'; expected one of target.depth, target.depth_rate, "
            "template.inverse_distance");
  EXPECT_EQ(text([&] { ekf.Expect("stereo", 0); }),
            "the problem has no sensor 'stereo'; expected one of disparity, inverse_scale");
}

TEST(Live, AReadingThatNoSensorTakesIsAnErrorAndChangesNothing) {
  Ekf ekf = MakeLive<Ekf>();
  ekf.Start(0);
  const State before = ekf.state();
  EXPECT_THROW(ekf.Push(1'000'000, {{2, {80.0}}}), Error);
  EXPECT_THROW(ekf.Push(1'000'000, {{-1, {80.0}}}), Error);
  EXPECT_THROW(ekf.Push(1'000'000, {{0, {80.0}}, {1, {1.0, 2.0}}}), Error);
  EXPECT_THROW(ekf.Push(1'000'000, {{0, {80.0}, -1, {1.0, 0.0}}}), Error);
  ExpectSame(ekf.state(), before);
  EXPECT_EQ(ekf.timestamp(), 0);
  EXPECT_EQ(ekf.Push(1'000'000, {{0, {80.0}, -1, {4.0}}}).measurements().size(), 1u);
}

TEST(Live, ExpectsNothingWhereHIsNotDefinedOrNothingIsThereToMeasure) {
  Problem problem = DepthFilter();
  problem.priors[0].mean = {-0.1};  // the target is behind the camera
  Ekf behind(problem, {}, StreamsOf(problem));
  behind.Start(0);
  EXPECT_FALSE(behind.Expect("disparity", 0));
  Problem waiting = DepthFilter();
  waiting.priors[0] = {waiting.priors[0].block, {}, {}, "disparity"};
  Ekf empty(waiting, {}, StreamsOf(waiting));
  empty.Start(0);
  EXPECT_FALSE(empty.Expect("disparity", 0));
  EXPECT_FALSE(empty.diverged());
}

TEST(Live, ExpectsNothingThatIsNotFinite) {
  for (const double x : {1.0, 7.0}) {
    Problem problem;
    AddMotion(problem, "p", testing::ConstantMotion(1), {{"x", x, 0.1}});
    AddSensor(problem, "z", MakeSensor(Broken(), "broken"), {"p.x"});
    Ekf ekf(problem, {}, StreamsOf(problem));
    ekf.Start(0);
    EXPECT_EQ(ekf.Expect("z", 0).has_value(), x < 5.0);
  }
}

TEST(Live, ExpectsASensorWhoseStreamTheSourceLacks) {
  Problem problem = DepthFilter();
  const std::vector<StreamInfo> one = {StreamsOf(problem)[1]};
  Ekf ekf(problem, {}, one), none(problem, {}, {});
  for (Ekf* filter : {&ekf, &none}) {
    filter->Start(0);
    const auto expected = filter->Expect("disparity", 0);
    ASSERT_TRUE(expected);
    EXPECT_NEAR(expected->z[0], 26.0 / 0.35, 1e-12);
  }
}

TEST(Live, ExpectsNothingOfThePast) {
  Ekf ekf = MakeLive<Ekf>();
  ekf.Process(FrameAt(1.0, {{0, 74.0}}));
  EXPECT_TRUE(ekf.Expect("disparity", ekf.timestamp()));
  EXPECT_FALSE(ekf.Expect("disparity", ekf.timestamp() - 1));
}

TEST(Live, AnEndedFilterExpectsNothing) {
  Problem problem = DepthFilter();
  EkfOptions options;
  options.max_dt_s = 1e-9;  // the next frame would take too many steps
  Ekf ekf(problem, options, StreamsOf(problem));
  ekf.Start(0);
  EXPECT_TRUE(ekf.Expect("disparity", 0));
  ekf.Process(FrameAt(10.0, {{0, 74.0}}));
  ASSERT_TRUE(ekf.failed());
  EXPECT_FALSE(ekf.Expect("disparity", ekf.timestamp()));
}

// H is evaluated at the depth that the expected z implies. So S equals the S of a measurement of
// the expected z.
TEST(Live, ExpectsByWhatTheExpectedMeasurementImplies) {
  Problem problem = DepthFilter();
  problem.sensors[0].roles[0].jacobian_at = JacobianAt::kMeasurement;
  Ekf ekf(problem, {}, StreamsOf(problem));
  ekf.Start(0);
  const auto expected = ekf.Expect("disparity", 0);
  ASSERT_TRUE(expected);
  const UpdateReport& report = ekf.Push(0, {{0, expected->z}});
  EXPECT_NEAR(expected->s(0, 0), report.measurements()[0].s[0], 1e-9 * expected->s(0, 0));
}

// The results are identical bit for bit, including covariances and landmarks.
TEST(Live, PushIsProcess) {
  Ekf pushed(MapSystem(Offset(0.1), {}, 0.3), {}, {{"tracks", 3}});
  Ekf processed = pushed;
  const std::vector<double> r = {0.02, 0.0, 0.0, 0.0, 0.03, 0.01, 0.0, 0.01, 0.04};
  for (int k = 0; k < 4; ++k) {
    Frame frame = FrameOf(0.1 * k, {{7, {0.1 * k, 0.0, 1.0}}, {8, {0.0, 0.2 * k, 2.0}}});
    frame.measurements[1].covariance = r;
    std::vector<Reading> readings;
    for (const Measurement& m : frame.measurements) {
      readings.push_back({m.stream, m.values, m.landmark, m.covariance});
    }
    pushed.Push(frame.timestamp, readings);
    processed.Process(frame);
    ExpectSame(pushed.state(), processed.state());
  }
  ASSERT_EQ(pushed.landmarks().size(), 2u);
  EXPECT_GT(pushed.landmarks()[1].covariance(0, 0), pushed.landmarks()[0].covariance(0, 0));
}

TEST(Live, AQuaternionThatIsNoneIsAnErrorAndChangesNothing) {
  const Problem problem = WalkingOrientation();
  Ekf ekf(problem, {}, StreamsOf(problem));
  ekf.Start(0);
  const State before = ekf.state();
  EXPECT_THROW(ekf.Push(0, {{0, {0.0, 0.0, 0.0, 0.0}}}), Error);
  EXPECT_THROW(ekf.Push(0, {{0, {1.01, 0.0, 0.0, 0.0}}}), Error);
  ExpectSame(ekf.state(), before);
  EXPECT_EQ(ekf.Push(0, {{0, {1.0005, 0.0, 0.0, 0.0}}}).measurements()[0].outcome,
            Outcome::kAccepted);
}

TEST(Live, ExpectsALandmarkByItsId) {
  Ekf ekf(MapSystem(Offset(0.1), {}, 0.3), {}, {{"tracks", 3}});
  ekf.Process(FrameOf(0.0, {{7, {0, 0, 1}}}));
  const auto seen = ekf.Expect("tracks", 0, 7);
  ASSERT_TRUE(seen);
  EXPECT_NEAR(seen->z[2], 1.0, 1e-12);
  // The landmark was initialised from a measurement with the same noise, so S = 2 R. S does not
  // depend on the P of the camera.
  EXPECT_NEAR(seen->s(0, 0), 2.0 * 0.1 * 0.1, 1e-12);
  EXPECT_FALSE(ekf.Expect("tracks", 0, 8));
  EXPECT_FALSE(ekf.Expect("tracks", 0));
}

// If this test runs with the thread sanitizer, it detects data races.
TEST(Live, ThreadsMayAskOneFilterAtOnceAndMoveTheirOwnCopies) {
  Ekf ekf = MakeLive<Ekf>();
  const std::vector<Frame> frames = Swinging(30, 5);
  for (const Frame& frame : frames) ekf.Process(frame);
  const Timestamp later = ekf.timestamp() + 30'000'000;
  const State once = ekf.At(later);
  std::vector<std::thread> threads;
  std::vector<char> same(4, 0);
  for (std::size_t i = 0; i < same.size(); ++i) {
    threads.emplace_back([&, i] {
      bool all = true;
      Ekf own = ekf;
      for (int k = 0; k < 50; ++k) {
        all = all && ekf.At(later).values() == once.values();
        own.Push(own.timestamp() + 1'000'000, {{0, {80.0}}});
      }
      same[i] = all && own.timestamp() == ekf.timestamp() + 50'000'000 ? 1 : 0;
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(same, std::vector<char>(4, 1));
}

// Times are in nanoseconds. Code that passes seconds as a double does not compile.
template <class T>
concept TakesTime = requires(Filter& filter, T t) {
  filter.At(t);
};
template <class T>
concept ExpectsAt = requires(Filter& filter, T t) {
  filter.Expect("disparity", t);
};
static_assert(TakesTime<Timestamp> && TakesTime<int> && !TakesTime<double>);
static_assert(ExpectsAt<Timestamp> && ExpectsAt<int> && !ExpectsAt<double>);

TEST(FilterOptions, OutOfTheirRangeAreNamed) {
  const Problem problem = DepthFilter();
  const auto refused = [&](const EkfOptions& options, const char* what) {
    try {
      Ekf(problem, options, StreamsOf(problem));
    } catch (const Error& error) {
      return std::string(error.what()).find(what) != std::string::npos;
    }
    return false;
  };
  for (const double gate : {-1.0, 0.0, 2.0, std::nan("")}) {
    EXPECT_TRUE(refused({.gate = gate}, "option gate is ")) << gate;
  }
  for (const double dt_s : {0.0, -1.0, std::nan("")}) {
    EXPECT_TRUE(refused({.max_dt_s = dt_s}, "option max_dt_s is ")) << dt_s;
  }
  EXPECT_TRUE(refused({.rejection_recovery_after = 0}, "rejection_recovery_after is 0"));
  EXPECT_TRUE(refused({.max_covariance_repairs = -1}, "max_covariance_repairs is -1"));
  EXPECT_FALSE(refused({}, "EkfOptions"));
}

}  // namespace
}  // namespace alidade::testing
