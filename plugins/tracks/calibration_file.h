// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "alidade/config/config.h"

namespace alidade {

/// The `calibration.yaml` next to tracks, under the keys by which models ask. It has one of two
/// forms:
///
///   written as                                        key
///   camera: {width, height, fx, fy, cx, cy, ...}      camera.*, as `alidade simulate` writes it
///
///   image: {width, height}                            camera.width, camera.height
///   intrinsics_px: {fx, fy, cx, cy}                   camera.fx and so on, of a pinhole
///   baseline_m                                        camera.baseline_m, of a rectified pair
///   vehicle_from_cam: {position_m, quaternion}        vehicle_from_cam.position, .orientation
///
/// `sigma_px`, for `alidade bundle`, is left out.
///
/// Errors       kBadData with file, line and column; kInputMissing.
class CalibrationFile {
 public:
  static Config Read(const std::filesystem::path& file) {
    try {
      return CalibrationFile(file).to_;
    } catch (const Error& error) {
      if (error.code() != ExitCode::kBadConfig) throw;
      throw Error(ExitCode::kBadData,
                  std::string(error.what()) + "; 'source.calibration: ignore' does without it");
    }
  }

 private:
  explicit CalibrationFile(const std::filesystem::path& file)
      : from_(Config::FromFile(file)), to_(Config::FromText("calibration: {}", file.string())) {
    const Node root = from_.root();
    root.Declare("sigma_px");
    if (const auto camera = root.Find("camera")) {
      for (const auto& [key, value] : camera->Entries()) Copy(value, "camera." + key);
      if (!camera->Find("model")) Set("camera.model", "pinhole", camera->place());
    } else {
      ReadIntrinsics(root);
    }
    root.RejectUnread();
  }

  void ReadIntrinsics(const Node& root) {
    const auto intrinsics = root.Find("intrinsics_px");
    if (!intrinsics) root.Fail("no calibration of a camera", "'camera' or 'intrinsics_px'");
    for (const char* key : {"fx", "fy", "cx", "cy"}) {
      Copy(intrinsics->At(key), std::string("camera.") + key);
    }
    Set("camera.model", "pinhole", intrinsics->place());
    const Node image = root.At("image");
    for (const char* key : {"width", "height"}) Copy(image.At(key), std::string("camera.") + key);
    if (const auto baseline = root.Find("baseline_m")) Copy(*baseline, "camera.baseline_m");
    if (const auto mount = root.Find("vehicle_from_cam")) {
      Copy(mount->At("position_m"), "vehicle_from_cam.position");
      const Node quaternion = mount->At("quaternion");
      for (const char* key : {"w", "x", "y", "z"}) {
        Copy(quaternion.At(key), std::string("vehicle_from_cam.orientation.") + key);
      }
      quaternion.RejectUnread();
    }
  }

  void Copy(const Node& value, const std::string& key) { Set(key, value.ToYaml(), value.place()); }
  void Set(const std::string& key, const std::string& yaml, const Place& place) {
    to_.Set("calibration." + key, yaml, ToString(place));
  }

  Config from_, to_;
};

}  // namespace alidade
