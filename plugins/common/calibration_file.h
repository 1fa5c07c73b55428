// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "alidade/config/config.h"

namespace alidade {

/// Reads the `calibration.yaml` next to tracks or images, and converts it to the keys that models
/// use. The file has one of these forms:
///
///   in the file                                       key
///   camera: {width, height, fx, fy, cx, cy, ...}      camera.*; written by `alidade simulate`
///
///   image: {width, height}                            camera.width, camera.height
///   intrinsics_px: {fx, fy, cx, cy}                   camera.fx, ...; pinhole camera
///   baseline_m                                        camera.baseline_m; rectified pair
///   vehicle_from_cam: {position_m, quaternion}        vehicle_from_cam.position, .orientation
///
///   camera_matrix, distortion_coefficients: {data}, image_width, image_height, [distortion_model:
///   plumb_bob, rational_polynomial or equidistant]           OpenCV and ROS
///
///   cam0: {camera_model: pinhole, intrinsics, distortion_model: radtan or equidistant,
///   distortion_coeffs, resolution}                           Kalibr
///
///   camera_model: pinhole, intrinsics, distortion_model: radial-tangential or equidistant,
///   distortion_coefficients, resolution                      EuRoC
///
/// In the last three forms, only the keys listed here are read. Each form may also contain the key
/// `sigma_px`, which only `alidade bundle` reads.
///
/// Errors       kBadData with file, line and column; kInputMissing.
Config ReadCalibrationFile(const std::filesystem::path& file);

}  // namespace alidade
