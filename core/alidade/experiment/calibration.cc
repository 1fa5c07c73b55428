// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/calibration.h"

#include <optional>

namespace alidade::internal {
namespace {

/// Counts all below `map` as read: no model needs to ask for all that the data tell.
void ReadAll(const Node& map) {
  for (const auto& [key, value] : map.Entries()) {
    if (value.is_map()) ReadAll(value);
  }
}

}  // namespace

Config WithCalibration(const Config& config, const Source& source) {
  const Node root = config.root();
  if (const auto written = root.Find("calibration")) {
    written->Fail("not a key of a config: calibration comes from the data", "'camera'");
  }
  const auto use = root.At("source").Find("calibration");
  if (use && use->Choice({"use", "ignore"}) == 1) return config;
  const std::optional<Config> calibration = source.Calibration();
  if (use && !calibration) use->Fail("this source brings no calibration", "no such key");
  if (!calibration) return config;
  Config with = config.Merged(calibration->root());
  ReadAll(with.root().At("calibration"));
  return with;
}

}  // namespace alidade::internal
