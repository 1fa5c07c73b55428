// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/stream_patterns.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "support/config_text.h"

namespace alidade {
namespace {

using testing::Message;
using testing::Read;

const std::vector<StreamInfo> kStreams = {{.name = "gps", .size = 2},
                                          {.name = "range_1_m", .size = 1},
                                          {.name = "range_A7_m", .size = 1}};

std::string ExpandedPatterns(const std::string& text) {
  Config config = Read(text);
  ExpandStreamPatterns(config, kStreams);
  return config.ToYaml();
}

TEST(StreamPatterns, ASensorForEachMatchingStream) {
  EXPECT_EQ(
      ExpandedPatterns("sensors: {gps: {stream: gps}, b*: {stream: range_*_m, sigma_m: 2}, c: {}}\n"
                       "estimators:\n"
                       "  ekf: {sensors: [b*, gps]}\n"
                       "  ukf: {overrides: {sensors: {b*: {sigma_m: 3}, gps: {sigma_m: 4}}}}\n"),
      Read("sensors: {gps: {stream: gps}, b1: {stream: range_1_m, sigma_m: 2}, bA7: {stream: "
           "range_A7_m, sigma_m: 2}, c: {}}\n"
           "estimators:\n"
           "  ekf: {sensors: [b1, bA7, gps]}\n"
           "  ukf: {overrides: {sensors: {b1: {sigma_m: 3}, bA7: {sigma_m: 3}, gps: "
           "{sigma_m: 4}}}}\n")
          .ToYaml());
}

TEST(StreamPatterns, AConfigWithoutPatternsIsUnchanged) {
  for (const char* text :
       {"sensors: {gps: {stream: gps}}\nestimators: {ekf: {sensors: [gps]}}\n", "sensors: [1]\n",
        "title: x\n", "sensors: {a: {stream: [b*]}, c*: 1}\n"}) {
    EXPECT_EQ(ExpandedPatterns(text), Read(text).ToYaml());
  }
}

TEST(StreamPatterns, Errors) {
  EXPECT_EQ(Message([] { ExpandedPatterns("sensors: {beacon: {stream: range_*_m}}\n"); }),
            "f.yaml:1:28 sensors.beacon.stream: the name of the sensor does not contain `*`, but "
            "its stream does; expected a name such as 'beacon_*'");
  EXPECT_EQ(
      Message([] { ExpandedPatterns("sensors: {b*: {stream: uwb_*}}\n"); }),
      "f.yaml:1:24 sensors.b*.stream: the source has no stream that matches 'uwb_*'; expected "
      "one of gps, range_1_m, range_A7_m");
}

}  // namespace
}  // namespace alidade
