// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "alidade/config/config.h"

namespace alidade {

/// Reads the `calibration.yaml` next to tracks or images, and converts it to the keys that models
/// use. The file has one of these forms:
///
///   in the file                                       key
///   camera: {width, height, fx, fy, cx, cy, ...}      camera.*, as `alidade simulate` writes it
///
///   image: {width, height}                            camera.width, camera.height
///   intrinsics_px: {fx, fy, cx, cy}                   camera.fx, ..., of a pinhole camera
///   baseline_m                                        camera.baseline_m, of a rectified pair
///   vehicle_from_cam: {position_m, quaternion}        vehicle_from_cam.position, .orientation
///
///   camera_matrix, distortion_coefficients: {data}, image_width, image_height, [distortion_model:
///   plumb_bob, rational_polynomial or equidistant]           OpenCV and ROS
///
///   cam0: {camera_model: pinhole, intrinsics, distortion_model: radtan or equidistant,
///   distortion_coeffs, resolution}                           Kalibr
///
///   camera_model: pinhole, intrinsics, distortion_model: radial-tangential or equidistant,
///   distortion_coefficients, resolution                      sensor of EuRoC
///
/// From the last three forms, only the values of the camera itself are read. The key `sigma_px`,
/// which is for `alidade bundle`, is not read from any form.
///
/// Errors       kBadData with file, line and column; kInputMissing.
Config ReadCalibrationFile(const std::filesystem::path& file);

}  // namespace alidade
