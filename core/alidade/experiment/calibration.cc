// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/calibration.h"

#include <optional>
#include <vector>

#include "alidade/config/tree.h"
#include "alidade/experiment/calibration_file.h"

namespace alidade::internal {
namespace {

/// Marks all keys below `map` as read, because no model has to read every key of a calibration.
void MarkAsRead(const Node& map) {
  for (const auto& [key, value] : map.Entries()) {
    if (value.is_map()) MarkAsRead(value);
  }
}

/// Returns the calibration of the data. An error names the key that ignores the calibration.
std::optional<Config> CalibrationOf(const Source& source) {
  try {
    return source.Calibration();
  } catch (const Error& error) {
    if (error.code() != ExitCode::kBadData) throw;
    throw Error(error.code(),
                std::string(error.what()) + "; 'source.calibration: ignore' skips the calibration");
  }
}

/// Replaces the key `file` of the map at `path`, such as `camera`, by the keys of this file.
void ExpandCameraFile(Config& config, const std::string& path, const Node& camera) {
  if (!camera.is_map() || !camera.HasUnread("file")) return;
  struct Value {
    std::string key, yaml, place;
  };
  std::vector<Value> values;
  const auto add = [&](const Node& map, const std::string& excluded) {
    for (const auto& [key, value] : map.Entries()) {
      if (key != "file" && key != excluded)
        values.push_back({key, value.ToYaml(), ToString(value.place())});
    }
  };
  const Node file = camera.At("file");
  const auto entry = camera.Find("entry");
  // The path is relative to the file that contains the key.
  const auto folder = std::filesystem::path(file.place().file).parent_path();
  const Config calibration =
      ReadCalibrationFile(folder / file.Text(), {.entry = entry ? entry->Text() : ""});
  add(calibration.root().At("calibration").At("camera"), "");
  add(camera, "entry");
  config.Set(path, "{}", ToString(file.place()));
  for (const auto& [key, yaml, place] : values) config.Set(path + '.' + key, yaml, place);
}

}  // namespace

Config WithCameraFiles(const Config& config) {
  Config expanded = config.Copy();
  const auto expand = [&](const std::string& path, const Node& map) {
    if (!map.is_map()) return;
    if (const auto camera = map.Find("camera"))
      ExpandCameraFile(expanded, path + "camera", *camera);
  };
  const Node root = expanded.root();
  expand("", root);
  if (const auto sensors = root.Find("sensors"); sensors && sensors->is_map()) {
    for (const auto& [name, sensor] : sensors->Entries()) expand("sensors." + name + '.', sensor);
  }
  return expanded.Copy();
}

Config WithCalibration(const Config& config, const Source& source) {
  const Node root = config.root();
  if (const auto node = root.Find("calibration")) {
    node->Fail("a config cannot contain this key, because the data provide the calibration",
               "the key 'camera'");
  }
  const auto use = root.At("source").Find("calibration");
  if (use && use->Choice({"use", "ignore"}) == 1) return config;
  const std::optional<Config> calibration = CalibrationOf(source);
  if (use && !calibration) {
    use->Fail("this source does not provide a calibration; remove this key");
  }
  if (!calibration) return config;
  Config calibrated = config.Merged(calibration->root());
  MarkAsRead(calibrated.root().At("calibration"));
  return calibrated;
}

Config WithoutCalibration(const Config& config) {
  Config copy = config.Copy();
  Remove(copy.tree(), "calibration");
  return copy;
}

}  // namespace alidade::internal
