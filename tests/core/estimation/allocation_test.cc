// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstdlib>

#include "alidade/estimation/iekf.h"
#include "alidade/estimation/invariant_error.h"
#include "alidade/estimation/square_root_ekf.h"
#include "alidade/estimation/ukf.h"
#include "alidade/io/log.h"
#include "support/driven.h"
#include "support/formula_models.h"
#include "support/landmark_models.h"
#include "support/sanitized.h"
#include "support/systems.h"

namespace {
std::atomic<long> allocations{0};
}  // namespace

// The sanitizers replace malloc, so allocations cannot be counted.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// These functions count every allocation of this program, including those of operator new and of
// Eigen.
extern "C" void* __libc_malloc(std::size_t size);  // NOLINT: a name of glibc
extern "C" void* malloc(std::size_t size) noexcept {
  ++allocations;
  return __libc_malloc(size);
}
#endif

namespace alidade {
namespace {

/// Returns the depth filter with a second motion model. No sensor uses the block of this model.
Problem WalkingDepthFilter() {
  Problem problem = testing::DepthFilter();
  testing::AddMotion(problem, "walk", testing::ConstantMotion(1, 0.1), {{"value", 0.0, 1.0}});
  return problem;
}

TEST(ControlInput, TakesNoAllocation) {
  Problem problem = testing::DepthFilter();
  testing::AddMotion(problem, "car", MakeMotion(testing::Driven(0.2), "driven"),
                     {{"position", 0.0, 1.0}});
  problem.motions.back().input = {"odometry", 0.05};
  std::vector<StreamInfo> streams = testing::StreamsOf(problem);
  streams.push_back({"odometry", 1});
  Ekf ekf(problem, {}, streams);
  std::vector<Frame> frames;
  for (int k = 0; k < 60; ++k) frames.push_back(testing::FrameAt(0.033 * k, {{2, 0.1 * k}}));
  for (std::size_t k = 0; k < 20; ++k) ekf.Process(frames[k]);
  const long before = allocations;
  for (std::size_t k = 20; k < frames.size(); ++k) ekf.Process(frames[k]);
  EXPECT_EQ(allocations - before, 0);
}

TEST(FormulaModels, TakeNoAllocation) {
  const SharedSensor sensor = testing::FormulaSensorOf(
      R"yaml(known: {anchor: [x, y, z]}
z: {range: norm(p - anchor), ray: "unit(rotate_inverse(q, p))"}
domain: p.x > 0
valid: z.range > 0
sigma: {range: 0.1 + 0.01 * norm(p), ray: 0.1}
initialise: {p: "anchor + z.range * rotate(q, z.ray)"}
)yaml",
      {testing::VectorSpace("p", 3), testing::NamedSpace("q", Geometry::UnitQuaternion())});
  const std::string blocks = "blocks: {q: unit_quaternion, w: [x, y, z]}\nnoise: {a: 0.1}\n";
  const SharedMotion step =
      testing::FormulaMotionOf(blocks + "step: {q: 'multiply(q, rotation(dt * w + a))'}\n");
  const SharedMotion rate = testing::FormulaMotionOf(blocks + "rate: {q: w, w: '[a, 0, 0]'}\n");
  const double p[] = {1, 2, 3}, q[] = {0.5, 0.5, -0.5, 0.5}, known[] = {4, 5, 6};
  const double z[] = {5, 0, 0.6, 0.8}, w[] = {0.1, 0.2, 0.3};
  const double *const roles[] = {p, q}, *const values[] = {q, w};
  double y[8], l[36], first[36], second[36];
  double *const jacobians[] = {first, second}, *const next[] = {y, y + 4};
  const int strides[] = {3, 3};
  const long before = allocations;
  EXPECT_EQ(sensor->Evaluate({z, known}, roles, {y, jacobians, strides, l}), Status::kOk);
  EXPECT_EQ(sensor->Valid({z, known}), Status::kOk);
  EXPECT_EQ(sensor->Initialise(roles, {z, known}, nullptr, {y, jacobians, strides, l}),
            Status::kOk);
  for (const SharedMotion& motion : {step, rate}) {
    EXPECT_EQ(motion->Step(values, nullptr, nullptr, 0.1, {next, first, second, l}), Status::kOk);
  }
  EXPECT_EQ(allocations - before, 0);
}

TEST(InvariantModels, TakeNoAllocation) {
  Problem problem;
  const StateHandle body = problem.AddState(
      "body", testing::Unicycle(),
      {{"position", {1.0, 2.0}, {0.5, 0.2}}, {"heading", {2.0}, {0.4}}, {"mast", {0.3, 0.1}, 0.1}},
      {"odometry"});
  problem.AddSensor("gnss", testing::OnMast(), {body["position"], body["heading"], body["mast"]});
  const Problem inner =
      internal::InvariantProblem({ErrorSide::kRight, {body["position"], body["heading"]}}, problem);
  const MotionModel& motion = *inner.motions[0].model;
  const SensorModel& sensor = *inner.sensors[0].model;
  const double element[] = {1, 2, 2}, mast[] = {0.3, 0.1}, input[] = {1.0, 0.2};
  const double* const blocks[] = {element, mast};
  double next_element[3], next_mast[2], f[25], g[25], h[2], j_element[6], j_mast[4];
  double *const next[] = {next_element, next_mast}, *const jacobians[] = {j_element, j_mast};
  const int strides[] = {3, 2};
  const long before = allocations;
  EXPECT_EQ(motion.Step(blocks, input, nullptr, 0.1, {next, f, g, nullptr}), Status::kOk);
  EXPECT_EQ(sensor.Linearise(blocks, h, jacobians, strides), Status::kOk);
  EXPECT_EQ(allocations - before, 0);
}

TEST(Log, TakesNoAllocationWithoutASink) {
  const long before = allocations;
  for (int i = 0; i < 100; ++i) Log(LogLevel::kError, "nobody hears this text of 40 characters");
  EXPECT_EQ(allocations - before, 0);
}

/// Returns frames with both sensors, with one sensor, with an outlier, without measurements, and
/// with the sensors in reverse order.
std::vector<Frame> Frames() {
  std::vector<Frame> frames;
  for (int k = 0; k < 60; ++k) {
    const double t = 0.033 * k, depth = 0.3 + 0.1 * std::sin(2.5 * t);
    const double d = k % 5 == 2 ? 500.0 : 26.0 / depth, s = depth / 0.3;
    switch (k % 7) {
      case 3:
        frames.push_back(testing::FrameAt(t, {{1, s}}));
        break;
      case 4:
        frames.push_back(testing::FrameAt(t, {}));
        break;
      case 5:
        frames.push_back(testing::FrameAt(t, {{1, s}, {0, d}}));
        break;
      default:
        frames.push_back(testing::FrameAt(t, {{0, d}, {1, s}}));
    }
  }
  return frames;
}

void ExpectNoAllocation(Estimator& filter) {
  if (testing::kSanitized) GTEST_SKIP() << "the sanitizer makes allocations of its own";
  const std::vector<Frame> frames = Frames();
  for (std::size_t k = 0; k < 20; ++k) filter.Process(frames[k]);
  const long before = allocations;
  EXPECT_GT(before, 0);  // checks that the counter works
  for (std::size_t k = 20; k < frames.size(); ++k) filter.Process(frames[k]);
  EXPECT_EQ(allocations - before, 0);
  EXPECT_FALSE(filter.diverged());
}

class Allocation : public ::testing::TestWithParam<Fuse> {
 protected:
  Allocation() : system_(WalkingDepthFilter()), streams_(testing::StreamsOf(system_)) {
    options_.fuse = GetParam();
    options_.gate = 0.999;
  }

  Problem system_;
  std::vector<StreamInfo> streams_;
  EkfOptions options_;
};

TEST_P(Allocation, AStepOfTheEkfTakesNone) {
  Ekf filter(system_, options_, streams_);
  ExpectNoAllocation(filter);
}

TEST_P(Allocation, AStepOfTheIteratedEkfTakesNone) {
  Iekf filter(system_, {options_}, streams_);
  ExpectNoAllocation(filter);
}

TEST_P(Allocation, AStepOfTheSquareRootEkfTakesNone) {
  SquareRootEkf filter(system_, options_, streams_);
  ExpectNoAllocation(filter);
}

TEST_P(Allocation, AStepOfTheUkfTakesNone) {
  UkfOptions options;
  options.filter = options_;
  options.alpha = 1.0;
  Ukf filter(system_, options, streams_);
  ExpectNoAllocation(filter);
}

INSTANTIATE_TEST_SUITE_P(Fuse, Allocation,
                         ::testing::Values(Fuse::kJoint, Fuse::kPerSensor, Fuse::kPerMeasurement));

/// Adds `count` states that perform a random walk. If `considered` is true, the first of these
/// states is a consider state.
void AddWalking(Problem& problem, int count, bool considered) {
  const SharedMotion model = testing::ConstantMotion(1, 0.1);
  for (int i = 0; i < count; ++i) {
    const std::string name = "other_" + std::to_string(i);
    const BlockId id = problem.layout.Declare(
        name + ".value", name, model->blocks()[0],
        considered && i == 0 ? BlockStatus::kConsider : BlockStatus::kEstimated);
    Prior prior;
    prior.block = id;
    prior.mean = {0.0};
    prior.covariance = Eigen::MatrixXd::Identity(1, 1);
    problem.priors.push_back(prior);
    problem.motions.push_back({name, model, {id}});
  }
}

/// Returns the pixel of landmark `id` in a camera that moves along x.
std::vector<double> PixelOf(std::int64_t id, double x) {
  const double angle = static_cast<double>(id), depth = 4.0 + static_cast<double>(id % 5);
  return {(3.0 * std::sin(angle) - x) / depth, 2.0 * std::cos(1.7 * angle) / depth};
}

/// Expects that frames with `measured` landmarks cause no allocations. The map contains 1.5 times
/// as many landmarks. From one frame to the next, a tenth of the measured landmarks is replaced by
/// others. One measurement of each frame is an outlier.
void ExpectNoAllocationOf(Filter& filter, int measured) {
  if (testing::kSanitized) GTEST_SKIP() << "the sanitizer makes allocations of its own";
  const int known = measured * 3 / 2, change = measured / 10;
  std::vector<Frame> frames;
  for (int k = 0; k < 60; ++k) {
    std::vector<testing::Observation> observations;
    for (int i = 0; i < measured; ++i) {
      const std::int64_t id = (k * change + i) % known;
      observations.push_back({id, PixelOf(id, 0.01 * k)});
    }
    observations[static_cast<std::size_t>(measured / 2)].z[0] += 3.0;
    frames.push_back(testing::FrameOf(0.1 * k, observations));
  }
  long before = 0;
  int initialised = 0, deleted = 0, converted = 0, accepted = 0;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    if (k == 40) before = allocations;
    const UpdateReport& report = filter.Process(frames[k]);
    if (k < 40) continue;
    initialised += report.landmarks.initialised;
    deleted += report.landmarks.deleted;
    converted += report.landmarks.converted;
    for (const MeasurementReport& entry : report.measurements()) {
      accepted += entry.outcome == Outcome::kAccepted;
    }
  }
  EXPECT_EQ(allocations - before, 0);
  EXPECT_FALSE(filter.diverged());
  EXPECT_GE(initialised, 20 * change);
  EXPECT_GE(deleted, 20 * change);
  EXPECT_GE(accepted, 15 * measured);
  if (filter.problem().landmarks->max_linearity_index > 0.0) {
    EXPECT_GT(converted, 0);
  }
}

LandmarkOptions Turnover() {
  LandmarkOptions options = testing::WithPrior(0.2, 0.1);
  options.max_missed_frames = 1;
  return options;
}

EkfOptions Gated() {
  EkfOptions options;
  options.gate = 0.999;
  return options;
}

TEST(AllocationOfLandmarks, AnUpdateOfManyTakesNone) {
  Problem problem = testing::MapSystem(testing::InverseDepthPixels(0.01), Turnover());
  AddWalking(problem, 10, /*considered=*/true);
  Ekf filter = testing::EkfOf(problem, Gated());
  ExpectNoAllocationOf(filter, 100);
  EXPECT_TRUE(IsSkipped() || filter.state().covariance().size() >= 13 + 6 * 100);
}

TEST(AllocationOfLandmarks, TheIteratedEkfTakesNone) {
  const Problem problem = testing::MapSystem(testing::InverseDepthPixels(0.01), Turnover());
  Iekf filter(problem, {Gated()}, {{"tracks", 2}});
  ExpectNoAllocationOf(filter, 20);
}

TEST(AllocationOfLandmarks, DirectionsAndSharedAnchorsTakeNone) {
  const Problem problem =
      testing::MapSystem(testing::AnchoredPixels<ALIDADE_ROLE_SHARED>(0.01), Turnover());
  Ekf filter = testing::EkfOf(problem, Gated());
  ExpectNoAllocationOf(filter, 20);
}

TEST(AllocationOfLandmarks, ConsensusAndConversionTakeNone) {
  LandmarkOptions options = Turnover();
  options.max_linearity_index = 10.0;
  options.prior->adapt_after = 3;
  Problem problem = testing::MapSystem(testing::InverseDepthPixels(0.01), options);
  problem.sensors[0].outlier_rejection = OnePointRansac{};
  Ekf filter = testing::EkfOf(problem, Gated());
  ExpectNoAllocationOf(filter, 20);
}

/// Returns a problem with thirty states: fifteen moving points, each with a sensor.
Problem ThirtyStates() {
  Problem problem;
  for (int i = 0; i < 15; ++i) {
    const std::string name = "p" + std::to_string(i);
    testing::AddMotion(problem, name, testing::ConstantVelocityMotion(1.0),
                       {{"x", 0.1 * i, 1.0}, {"v", 0.0, 1.0}});
    testing::AddSensor(problem, "of_" + name, testing::LinearSensor(1.0, 0.1), {name + ".x"});
  }
  return problem;
}

template <class Filter, class Options>
void ExpectNoAllocationOfThirtyStates(const Options& options) {
  if (testing::kSanitized) GTEST_SKIP() << "the sanitizer makes allocations of its own";
  const Problem problem = ThirtyStates();
  Filter filter(problem, options, testing::StreamsOf(problem));
  std::vector<Frame> frames;
  for (int k = 0; k < 30; ++k) {
    std::vector<std::pair<int, double>> values;
    for (int i = 0; i < 15; ++i) values.emplace_back(i, 0.1 * i + 0.01 * k);
    frames.push_back(testing::FrameAt(0.1 * k, values));
  }
  for (std::size_t k = 0; k < 10; ++k) filter.Process(frames[k]);
  const long before = allocations;
  for (std::size_t k = 10; k < frames.size(); ++k) filter.Process(frames[k]);
  EXPECT_EQ(allocations - before, 0);
  EXPECT_FALSE(filter.diverged());
}

TEST(AllocationOfThirtyStates, TheEkfTakesNone) {
  ExpectNoAllocationOfThirtyStates<Ekf>(EkfOptions{});
}
TEST(AllocationOfThirtyStates, TheIteratedEkfTakesNone) {
  ExpectNoAllocationOfThirtyStates<Iekf>(IekfOptions{});
}
TEST(AllocationOfThirtyStates, TheSquareRootEkfTakesNone) {
  ExpectNoAllocationOfThirtyStates<SquareRootEkf>(EkfOptions{});
}
TEST(AllocationOfThirtyStates, TheUkfTakesNone) {
  UkfOptions options;
  options.alpha = 1.0;
  ExpectNoAllocationOfThirtyStates<Ukf>(options);
}

}  // namespace
}  // namespace alidade
