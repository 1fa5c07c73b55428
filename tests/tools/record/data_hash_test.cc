// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/data_hash.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/systems.h"

namespace alidade {
namespace {

using internal::DataHash;

DataHash HashOf(const std::vector<SourceFrame>& frames,
                std::vector<StreamInfo> streams = {{"a"}, {"b"}},
                std::vector<StreamInfo> truths = {{"x", 1}}) {
  DataHash hash(std::move(streams), std::move(truths));
  for (const SourceFrame& frame : frames) hash.Add(frame);
  return hash;
}

SourceFrame MakeFrame(const std::vector<std::pair<int, double>>& values = {{0, 1.0}, {1, 2.0}}) {
  return {testing::FrameAt(0.1, values), {{0.5}}};
}

TEST(DataHash, DependsOnAllThatAnEstimatorSees) {
  const std::string hash = HashOf({MakeFrame()}).measurements();
  const auto changed = [](const auto& change) {
    SourceFrame frame = MakeFrame();
    change(frame);
    return HashOf({frame}).measurements();
  };
  EXPECT_NE(hash, changed([](SourceFrame& f) { f.timestamp += 1; }));
  EXPECT_NE(hash, changed([](SourceFrame& f) { f.measurements[0].timestamp += 1; }));
  EXPECT_NE(hash, changed([](SourceFrame& f) { f.measurements[0].stream = 1; }));
  EXPECT_NE(hash, changed([](SourceFrame& f) { f.measurements[0].landmark = 3; }));
  EXPECT_NE(hash, changed([](SourceFrame& f) {
              f.measurements[0].values[0] = std::nextafter(1.0, 2.0);
            }));
  EXPECT_NE(hash, changed([](SourceFrame& f) { f.measurements[0].covariance = {1.0}; }));
  EXPECT_NE(hash, changed([](SourceFrame& f) { f.measurements.pop_back(); }));
  EXPECT_NE(hash, HashOf({MakeFrame(), MakeFrame()}).measurements());
  EXPECT_NE(hash, HashOf({MakeFrame()}, {{"a"}, {"c"}}).measurements());
  EXPECT_EQ(hash, changed([](SourceFrame& f) { f.truth = {{0.7}}; }));
}

TEST(DataHash, IsOfContentNotOfItsOrderOrSign) {
  SourceFrame turned = MakeFrame();
  std::swap(turned.measurements[0], turned.measurements[1]);
  EXPECT_EQ(HashOf({MakeFrame()}).measurements(), HashOf({turned}).measurements());
  // The other source has the same streams in a different order.
  SourceFrame other = MakeFrame();
  other.measurements[0].stream = 1;
  other.measurements[1].stream = 0;
  EXPECT_EQ(HashOf({MakeFrame()}).measurements(), HashOf({other}, {{"b"}, {"a"}}).measurements());
  // The order of two measurements of the same stream changes the hash.
  const SourceFrame twice = MakeFrame({{0, 1.0}, {0, 2.0}});
  const SourceFrame back = MakeFrame({{0, 2.0}, {0, 1.0}});
  EXPECT_NE(HashOf({twice}).measurements(), HashOf({back}).measurements());
  const auto of_value = [](double value) {
    return HashOf({MakeFrame({{0, value}})}).measurements();
  };
  EXPECT_EQ(of_value(0.0), of_value(-0.0));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(of_value(nan), of_value(-nan));
}

TEST(DataHash, OfTruthsIsApart) {
  SourceFrame other = MakeFrame();
  other.truth = {{0.25}};
  EXPECT_NE(HashOf({MakeFrame()}).truth(), HashOf({other}).truth());
  other.truth = {{}};
  EXPECT_EQ(HashOf({other}).truth(), "");
  EXPECT_EQ(HashOf({}).truth(), "");
}

}  // namespace
}  // namespace alidade
