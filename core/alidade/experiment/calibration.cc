// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/calibration.h"

#include <optional>

namespace alidade::internal {
namespace {

/// Marks all keys below `map` as read, because no model has to read every key of a calibration.
void MarkAsRead(const Node& map) {
  for (const auto& [key, value] : map.Entries()) {
    if (value.is_map()) MarkAsRead(value);
  }
}

}  // namespace

Config WithCalibration(const Config& config, const Source& source) {
  const Node root = config.root();
  if (const auto node = root.Find("calibration")) {
    node->Fail("a config cannot contain this key, because the data provide the calibration",
               "the key 'camera'");
  }
  const auto use = root.At("source").Find("calibration");
  if (use && use->Choice({"use", "ignore"}) == 1) return config;
  const std::optional<Config> calibration = source.Calibration();
  if (use && !calibration) {
    use->Fail("this source does not provide a calibration; remove this key");
  }
  if (!calibration) return config;
  Config calibrated = config.Merged(calibration->root());
  MarkAsRead(calibrated.root().At("calibration"));
  return calibrated;
}

}  // namespace alidade::internal
