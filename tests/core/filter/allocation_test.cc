// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstdlib>

#include "alidade/base/log.h"
#include "alidade/filter/iekf.h"
#include "alidade/filter/square_root_ekf.h"
#include "alidade/filter/ukf.h"
#include "support/driven.h"
#include "support/sanitized.h"
#include "support/systems.h"

namespace {
std::atomic<long> allocations{0};
}  // namespace

#ifndef __SANITIZE_ADDRESS__  // which has its own
// Every allocation of this program is counted, those of operator new and of Eigen too.
extern "C" void* __libc_malloc(std::size_t size);  // NOLINT: of glibc
extern "C" void* malloc(std::size_t size) noexcept {
  ++allocations;
  return __libc_malloc(size);
}
#endif

namespace alidade {
namespace {

/// The depth filter, with a motion model besides that is of no sensor.
System WalkingDepthFilter() {
  System system = testing::DepthFilter();
  testing::AddMotion(system, "walk", InProcessMotion(Constant<>(1, 0.1), "constant"),
                     {{"value", 0.0, 1.0}});
  return system;
}

TEST(ControlInput, TakesNoAllocation) {
  System system = testing::DepthFilter();
  testing::AddMotion(system, "car", InProcessMotion(testing::Driven(0.2), "driven"),
                     {{"position", 0.0, 1.0}});
  system.motions.back().input = {"odometry", 0.05};
  std::vector<StreamInfo> streams = testing::StreamsOf(system);
  streams.push_back({"odometry", 1});
  Ekf ekf(system, {}, streams);
  std::vector<Frame> frames;
  for (int k = 0; k < 60; ++k) frames.push_back(testing::FrameAt(0.033 * k, {{2, 0.1 * k}}));
  for (std::size_t k = 0; k < 20; ++k) ekf.Process(frames[k]);
  const long before = allocations;
  for (std::size_t k = 20; k < frames.size(); ++k) ekf.Process(frames[k]);
  EXPECT_EQ(allocations - before, 0);
}

TEST(Log, TakesNoAllocationWithoutASink) {
  const long before = allocations;
  for (int i = 0; i < 100; ++i) Log(LogLevel::kError, "nobody hears this text of 40 characters");
  EXPECT_EQ(allocations - before, 0);
}

/// Both sensors, one, an outlier, none, and the other order.
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
  if (testing::kSanitized) GTEST_SKIP() << "the sanitizer allocates by itself";
  const std::vector<Frame> frames = Frames();
  for (std::size_t k = 0; k < 20; ++k) filter.Process(frames[k]);
  const long before = allocations;
  EXPECT_GT(before, 0);  // they are counted
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

  System system_;
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

}  // namespace
}  // namespace alidade
