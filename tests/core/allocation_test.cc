// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <new>

#include "support/driven.h"
#include "support/systems.h"

namespace {
std::atomic<long> allocations{0};
}  // namespace

// Every allocation of this program is counted. Not inlined, so that the compiler sees pairs.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  void* const memory = std::malloc(size == 0 ? 1 : size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace alidade {
namespace {

TEST(Allocation, AStepOfTheFilterTakesNone) {
  System system = testing::DepthFilter();
  testing::AddMotion(system, "walk", InProcessMotion(Constant<>(1, 0.1), "constant"),
                     {{"value", 0.0, 1.0}});
  for (const Fuse fuse : {Fuse::kJoint, Fuse::kPerSensor, Fuse::kPerMeasurement}) {
    EkfOptions options;
    options.fuse = fuse;
    options.gate = 0.999;
    Ekf ekf(system, options, testing::StreamsOf(system));
    std::vector<Frame> frames;
    for (int k = 0; k < 60; ++k) {
      const double t = 0.033 * k, depth = 0.3 + 0.1 * std::sin(2.5 * t);
      // Both, one, an outlier, none, and the other order.
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
    for (int k = 0; k < 20; ++k) ekf.Process(frames[static_cast<std::size_t>(k)]);
    const long before = allocations;
    for (std::size_t k = 20; k < frames.size(); ++k) ekf.Process(frames[k]);
    EXPECT_EQ(allocations - before, 0);
    EXPECT_FALSE(ekf.diverged());
  }
}

TEST(Allocation, AControlInputTakesNone) {
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

}  // namespace
}  // namespace alidade
