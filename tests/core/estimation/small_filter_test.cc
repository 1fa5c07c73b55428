// SPDX-License-Identifier: Apache-2.0
//
// Compares a filter of few states with the same filter plus unobserved states. The small filter
// uses unrolled kernels. The large filter has enough states for the vector kernels.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "alidade/estimation/ekf.h"
#include "support/given_noise.h"
#include "support/systems.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

/// Measures both elements of one block, with correlated noise.
struct CorrelatedPair : Sensor<Vec<2>, Vec<2>> {
  static constexpr std::array kRoles{Quantity{"x"}};
  static constexpr Quantity kMeasurement{"z"};
  template <class T>
  bool Predict(const T* x, T* z) const {
    z[0] = x[0] * x[1];
    z[1] = x[0] + 2.0 * x[1];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(0.3);
    l[2] = T(0.1);
    l[3] = T(0.2);
  }
};

/// Returns the problem with nine additional states. No sensor uses them.
Problem AmongOthers(Problem problem) {
  for (int i = 0; i < 9; ++i) {
    AddMotion(problem, "aside" + std::to_string(i), ConstantMotion(1), {{"x", 0.0, 1.0}});
  }
  return problem;
}

void ExpectEqual(std::span<const double> a, std::span<const double> b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (std::isnan(b[i])) {
      EXPECT_TRUE(std::isnan(a[i]));
    } else {
      EXPECT_NEAR(a[i], b[i], 1e-11 * (1.0 + std::abs(b[i])));
    }
  }
}

/// Returns the first `rows` elements of each column of a gain.
std::vector<double> Leading(std::span<const double> gain, int columns, std::size_t rows) {
  std::vector<double> leading;
  const std::size_t all = gain.size() / static_cast<std::size_t>(columns);
  for (std::size_t i = 0; i < gain.size(); ++i) {
    if (i % all < rows) leading.push_back(gain[i]);
  }
  return leading;
}

/// Runs both filters on the same frames and compares them. Returns how often each outcome and each
/// kind of event occurred.
std::map<std::string, int> Compare(const Problem& problem, const EkfOptions& options,
                                   const std::vector<Frame>& frames) {
  const Problem other = AmongOthers(problem);
  Ekf few(problem, options, StreamsOf(problem)), many(other, options, StreamsOf(other));
  std::map<std::string, int> seen;
  for (const Frame& frame : frames) {
    const UpdateReport& a = few.Process(frame);
    const UpdateReport& b = many.Process(frame);
    EXPECT_EQ(a.events.size(), b.events.size());
    for (const Event& event : b.events) ++seen[ToString(event.kind)];
    EXPECT_EQ(a.measurements().size(), b.measurements().size());
    for (std::size_t i = 0; i < a.measurements().size(); ++i) {
      const MeasurementReport& one = a.measurements()[i];
      const MeasurementReport& two = b.measurements()[i];
      ++seen[ToString(two.outcome)];
      EXPECT_EQ(one.sensor, two.sensor);
      EXPECT_EQ(one.outcome, two.outcome);
      EXPECT_EQ(one.dof, two.dof);
      EXPECT_NEAR(one.nis, two.nis, 1e-10 * (1.0 + two.nis));
      if (one.outcome == Outcome::kAccepted || one.outcome == Outcome::kGated) {
        const Eigen::Map<const RowMajor> cov(one.s.data(), one.dof, one.dof);
        const Eigen::Map<const Eigen::VectorXd> r(one.innovation.data(), one.dof);
        const double nis = r.dot(cov.fullPivLu().solve(r));
        EXPECT_NEAR(one.nis, nis, 1e-10 * (1.0 + nis));
      }
      ExpectEqual(one.z, two.z);
      ExpectEqual(one.h, two.h);
      ExpectEqual(one.innovation, two.innovation);
      ExpectEqual(one.s, two.s);
      EXPECT_EQ(one.gain.empty(), two.gain.empty());
      ExpectEqual(one.gain,
                  Leading(two.gain, two.dof, one.gain.size() / static_cast<std::size_t>(one.dof)));
    }
    EXPECT_EQ(few.diverged(), many.diverged());
    const int n = few.state().covariance().size();
    EXPECT_LT(
        (few.state().covariance().Dense() - many.state().covariance().Dense().topLeftCorner(n, n))
            .cwiseAbs()
            .maxCoeff(),
        1e-11);
    for (std::size_t i = 0; i < few.state().values().size(); ++i) {
      EXPECT_NEAR(few.state().values()[i], many.state().values()[i], 1e-11);
    }
    if (::testing::Test::HasFailure()) break;
  }
  return seen;
}

TEST(SmallEkf, DoesWhatALargeOneDoes) {
  EkfOptions options;
  options.gate = 0.99;
  options.rejection_recovery_after = 4;
  std::vector<Frame> frames;
  for (int k = 0; k < 400; ++k) {
    const double t = 0.033 * k, depth = 0.3 + 0.1 * std::sin(2.5 * t);
    const double wild = k % 19 == 7 || (k > 200 && k < 212) ? 40.0 : 0.0;
    const double d = k % 11 == 3 ? -1.0 : 26.0 / depth + 0.8 * std::sin(7.0 * k) + wild;
    const double s = depth / 0.3 + 0.01 * std::cos(5.0 * k);
    switch (k % 7) {
      case 2:
        frames.push_back(FrameAt(t, {{1, s}}));
        break;
      case 3:
        frames.push_back(FrameAt(t, {}));
        break;
      case 4:
        frames.push_back(
            // The frame has two measurements of one sensor.
            FrameAt(t, {{1, s}, {0, d}, {0, d + 0.5}}));
        break;
      case 5:
        frames.push_back(FrameAt(t, {{1, k % 3 == 0 ? std::nan("") : s}, {0, d}}));
        break;
      default:
        frames.push_back(FrameAt(t, {{0, d}, {1, s}}));
    }
    if (k % 23 == 5 && k % 7 != 3) frames.back().measurements[0].covariance = {2.0};
    if (k == 300) frames.back().timestamp -= TimestampFromSeconds(1.0);
  }
  auto seen = Compare(DepthFilter(), options, frames);
  for (const char* what :
       {"accepted", "gated", "invalid", "not_finite", "stale", "rejection_recovery"}) {
    EXPECT_GT(seen.count(what), 0u) << what;
  }
}

/// Returns frames that are 0.01 s apart. The disparity fits a depth of 0.3 m, except in the frames
/// [first, last).
std::vector<Frame> WildFrom(int first, int last, int count) {
  std::vector<Frame> frames;
  for (int k = 0; k < count; ++k) {
    const double wild = k >= first && k < last ? 60.0 : 0.0;
    frames.push_back(FrameAt(0.01 * k, {{0, 26.0 / 0.3 + wild + 0.5 * std::sin(3.0 * k)}}));
  }
  return frames;
}

// A reset must not change the order of the blocks in the state.
TEST(SmallEkf, IsResetAsALargeOne) {
  EkfOptions options;
  options.gate = 0.999;
  options.rejection_recovery_after = 3;
  auto seen = Compare(DepthFilter(), options, WildFrom(20, 30, 80));
  EXPECT_GE(seen["rejection_recovery"], 2);  // resets to the wrong depth and back
}

// The block without a value comes before blocks that have a prior.
TEST(SmallEkf, StartsABlockFromAMeasurementAsALargeOne) {
  Problem problem = DepthFilter();
  problem.priors[0] = {0, {}, {}, "disparity"};
  auto seen = Compare(problem, {}, WildFrom(0, 0, 20));
  EXPECT_EQ(seen["initialised"], 1);
  EXPECT_EQ(seen["accepted"], 19);
}

// An accepted measurement ends the first sequence of rejections. So the second sequence inflates P
// again.
TEST(SmallEkf, AnAcceptedMeasurementEndsARecovery) {
  EkfOptions options;
  options.gate = 0.999;
  options.rejection_recovery_after = 3;
  options.rejection_recovery = RejectionRecovery::kInflate;
  std::vector<Frame> frames = WildFrom(20, 23, 40);
  const std::vector<Frame> again = WildFrom(33, 36, 40);
  std::copy(again.begin() + 30, again.end(), frames.begin() + 30);
  auto seen = Compare(DepthFilter(), options, frames);
  EXPECT_EQ(seen["rejection_recovery"], 2);
  EXPECT_EQ(seen["gated"], 6);
}

TEST(SmallEkf, StacksMeasurementsOfSeveralRows) {
  Problem problem;
  const BlockId x = problem.layout.Declare("a.x", "a", testing::ConstantMotion(2)->blocks()[0]);
  problem.motions.push_back({"a", testing::ConstantMotion(2, 0.4), {x}});
  Prior prior;
  prior.block = x;
  prior.mean = {1.5, 0.7};
  prior.covariance = Eigen::Matrix2d{{0.5, 0.1}, {0.1, 0.3}};
  problem.priors.push_back(prior);
  AddSensor(problem, "first", MakeSensor(CorrelatedPair(), "pair"), {"a.x"});
  AddSensor(problem, "second", MakeSensor(CorrelatedPair(), "pair"), {"a.x"});
  EkfOptions options;
  options.gate = 0.999;
  std::vector<Frame> frames;
  for (int k = 0; k < 50; ++k) {
    Frame frame = FrameAt(0.1 * k, {});
    for (int stream = 0; stream < (k % 3 == 0 ? 1 : 2); ++stream) {
      const double wild = k % 10 == 9 ? 20.0 : 0.0;
      frame.measurements.push_back(
          {frame.timestamp, stream, -1, {1.0 + 0.2 * std::sin(k + stream), 3.0 + wild}, {}});
    }
    frames.push_back(frame);
  }
  const auto seen = Compare(problem, options, frames);
  EXPECT_GT(seen.count("gated"), 0u);
}

/// A CorrelatedPair with much larger noise.
struct LoudPair : CorrelatedPair {
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = l[3] = T(7.0);
  }
};

TEST(SmallEkf, TakesAGivenNoiseInPlaceOfTheModels) {
  const auto make = [](const SharedSensor& sensor, const SharedMotion& motion) {
    Problem problem = HeldPoint(0.7);
    problem.motions[0].model = motion;
    const BlockId x = problem.layout.Declare("a.x", "a", ConstantMotion(2)->blocks()[0]);
    problem.motions.push_back({"a", ConstantMotion(2, 0.4), {x}});
    problem.priors.push_back({x, {1.5, 0.7}, Eigen::Matrix2d{{0.5, 0.1}, {0.1, 0.3}}, {}});
    AddSensor(problem, "pair", sensor, {"a.x"});
    AddSensor(problem, "z", LinearSensor(2.0, 0.3), {"p.x"});
    return problem;
  };
  const Problem own = make(MakeSensor(CorrelatedPair(), "pair"), ConstantVelocityMotion(0.7));
  const Problem given = make(SensorOfNoise(LoudPair(), {0.3, 0.0, 0.1, 0.2}),
                             MotionOfNoise(ConstantVelocity<1, false>(5.0), {0.7}));
  Ekf a(own, {}, StreamsOf(own)), b(given, {}, StreamsOf(given));
  for (int k = 0; k < 20; ++k) {
    Frame frame = FrameAt(0.1 * k, {{1, 2.0 * std::cos(0.1 * k)}});
    frame.measurements.push_back({frame.timestamp, 0, -1, {1.0 + 0.2 * std::sin(k), 3.0}, {}});
    a.Process(frame);
    b.Process(frame);
    EXPECT_EQ(a.state().values(), b.state().values());
    EXPECT_EQ(a.state().covariance().Dense(), b.state().covariance().Dense());
  }
}

/// Motion model x' = x + w. The square root of Qw is not triangular.
struct Shaken : Motion<2, Vec<2>> {
  static constexpr std::array kBlocks{Quantity{"x"}};
  template <class T>
  void Step(const T* x, const T* w, double, T* next) const {
    next[0] = x[0] + w[0];
    next[1] = x[1] + w[1];
  }
  void SqrtQ(double dt_s, MatrixRef l) const {
    l(0, 0) = l(1, 1) = 0.3 * dt_s;
    l(0, 1) = 0.8 * dt_s;
  }
};

/// Motion model x' = x + dt (x_2, -x_1), without noise.
struct Spinning : Motion<0, Vec<2>> {
  static constexpr std::array kBlocks{Quantity{"x"}};
  template <class T>
  void Step(const T* x, const T*, double dt_s, T* next) const {
    next[0] = x[0] + dt_s * x[1];
    next[1] = x[1] - dt_s * x[0];
  }
  void SqrtQ(double, MatrixRef) const {}
};

TEST(SmallEkf, TakesAnySquareRootOfTheNoiseAndMotionWithoutNoise) {
  for (const SharedMotion& model :
       {MakeMotion(Shaken(), "shaken"), MakeMotion(Spinning(), "turning")}) {
    Problem problem;
    const BlockId x = problem.layout.Declare("a.x", "a", model->blocks()[0]);
    problem.motions.push_back({"a", model, {x}});
    Prior prior;
    prior.block = x;
    prior.mean = {1.5, 0.7};
    prior.covariance = Eigen::Matrix2d{{0.5, 0.1}, {0.1, 0.3}};
    problem.priors.push_back(prior);
    AddSensor(problem, "pair", MakeSensor(CorrelatedPair(), "pair"), {"a.x"});
    std::vector<Frame> frames;
    for (int k = 0; k < 20; ++k) {
      Frame frame = FrameAt(0.1 * k, {});
      frame.measurements.push_back({frame.timestamp, 0, -1, {1.0, 3.0}, {}});
      frames.push_back(frame);
    }
    EXPECT_EQ(Compare(problem, {}, frames)["accepted"], 20);
  }
}

/// Measures the same number K times.
template <int K>
struct Repeated : Sensor<Vec<K>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"x"}};
  static constexpr Quantity kMeasurement{"z"};
  template <class T>
  bool Predict(const T* x, T* z) const {
    std::fill_n(z, K, x[0]);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    for (int i = 0; i < K; ++i) l[(K + 1) * i] = T(0.2);
  }
};

// The first gain has 3 rows and 2 columns, because only 2 states are initialised. The later gain of
// 2 measured rows and 3 states has the same number of elements.
TEST(SmallEkf, AReportHasTheSizesOfItsOwnMeasurement) {
  Problem problem = DepthFilter();
  problem.priors[2] = {2, {}, {}, "inverse_scale"};
  AddSensor(problem, "three", MakeSensor(Repeated<3>(), "three"), {"target.depth"});
  AddSensor(problem, "two", MakeSensor(Repeated<2>(), "two"), {"target.depth"});
  std::vector<Frame> frames = {FrameAt(0.0, {{0, 74.0}, {2, 0.35}}), FrameAt(0.1, {{1, 1.0}}),
                               FrameAt(0.2, {{0, 74.0}, {3, 0.35}})};
  frames[0].measurements[1].values = {0.35, 0.34, 0.36};
  frames[2].measurements[1].values = {0.35, 0.34};
  EXPECT_EQ(Compare(problem, {}, frames)["accepted"], 4);
}

// ---- every number of states ---------------------------------------------------------------------

/// Measures two elements from two blocks, with correlated noise.
struct Both : Sensor<Vec<2>, Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"a"}, Quantity{"b"}};
  static constexpr Quantity kMeasurement{"z"};
  template <class T>
  bool Predict(const T* a, const T* b, T* z) const {
    z[0] = a[0] * b[0];
    z[1] = a[0] + 2.0 * b[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = T(0.5);
    l[2] = T(0.1);
    l[3] = T(0.4);
  }
};

/// Measures z = a + t_1 t_2 + t_3.
struct Mixed : Sensor<Vec<1>, Vec<1>, Vec<3>> {
  static constexpr std::array kRoles{Quantity{"a"}, Quantity{"t"}};
  static constexpr Quantity kMeasurement{"z"};
  template <class T>
  bool Predict(const T* a, const T* t, T* z) const {
    z[0] = a[0] + t[0] * t[1] + t[2];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = T(0.5);
  }
};

/// Adds a block `t.x` of three elements that perform a random walk. The priors of the elements are
/// correlated.
void AddTriple(Problem& problem) {
  const SharedMotion walk = testing::ConstantMotion(3, 0.2);
  const BlockId id = problem.layout.Declare("t.x", "t", walk->blocks()[0]);
  problem.motions.push_back({"t", walk, {id}});
  const Eigen::Matrix3d p{{0.09, 0.02, 0.01}, {0.02, 0.04, -0.01}, {0.01, -0.01, 0.16}};
  problem.priors.push_back({id, {1.0, 1.0, 1.0}, p, ""});
}

/// Returns a problem with `n` states. If n >= 4, three of the states form one block. The remaining
/// states form as many pairs of position and velocity as possible. All motions have noise. The
/// sensors relate the first scalar to the other states.
Problem OfSize(int n) {
  Problem problem;
  const bool triple = n >= 4;
  const int rest = triple ? n - 3 : n;
  std::vector<std::string> scalars;
  for (int i = 0; i < rest / 2; ++i) {
    const std::string name = "p" + std::to_string(i);
    AddMotion(problem, name, testing::ConstantVelocityMotion(0.7),
              {{"x", 1.0, 0.3}, {"v", 0.0, 0.2}});
    scalars.push_back(name + ".x");
  }
  if (rest % 2 == 1) {
    AddMotion(problem, "s", testing::ConstantMotion(1, 0.3), {{"x", 1.0, 0.3}});
    scalars.emplace_back("s.x");
  }
  if (triple) AddTriple(problem);
  AddSensor(problem, "first", LinearSensor(2.0, 0.5), {scalars[0]});
  if (triple) AddSensor(problem, "mixed", MakeSensor(Mixed(), "mixed"), {scalars[0], "t.x"});
  for (std::size_t i = 1; i < scalars.size() && i < 3; ++i) {
    AddSensor(problem, "both" + std::to_string(i), MakeSensor(Both(), "both"),
              {scalars[0], scalars[scalars.size() - i]});
  }
  return problem;
}

class SmallEkfOfSize : public ::testing::TestWithParam<int> {};

// Each frame has one measurement, two measurements, or one measurement of every sensor. The updates
// have 1 to 6 rows.
TEST_P(SmallEkfOfSize, DoesWhatALargeOneDoes) {
  const Problem problem = OfSize(GetParam());
  ASSERT_EQ(problem.InitialState().covariance().size(), GetParam());
  const int sensors = static_cast<int>(std::ssize(problem.sensors));
  std::vector<Frame> frames;
  for (int k = 0; k < 80; ++k) {
    Frame frame = FrameAt(0.05 * k, {});
    const int count = k % 4 == 0 ? 1 : k % 4 == 1 ? 2 : sensors;
    for (int i = 0; i < std::min(count, sensors); ++i) {
      const int stream = (k / 4 + i) % sensors;
      const std::string& name = problem.sensors[static_cast<std::size_t>(stream)].name;
      const double noise = 0.4 * std::sin(3.0 * k + stream) + (k % 17 == 11 ? 9.0 : 0.0);
      std::vector<double> z = {2.0 + noise};
      if (name == "mixed") z = {3.0 + noise};
      if (name.starts_with("both")) z = {1.0 + noise, 3.0 - noise};
      frame.measurements.push_back({frame.timestamp, stream, -1, z, {}});
    }
    frames.push_back(frame);
  }
  EkfOptions options;
  options.gate = 0.999;
  auto seen = Compare(problem, options, frames);
  EXPECT_GT(seen["accepted"], 60);
  EXPECT_GT(seen["gated"], 0);
}

INSTANTIATE_TEST_SUITE_P(UpToNine, SmallEkfOfSize, ::testing::Range(1, 10));

}  // namespace
}  // namespace alidade
