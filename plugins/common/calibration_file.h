// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "alidade/config/config.h"

namespace alidade {

/// The `calibration.yaml` next to tracks or images, under the keys by which models ask. It has one
/// of these forms:
///
///   written as                                        key
///   camera: {width, height, fx, fy, cx, cy, ...}      camera.*, as `alidade simulate` writes it
///
///   image: {width, height}                            camera.width, camera.height
///   intrinsics_px: {fx, fy, cx, cy}                   camera.fx and so on, of a pinhole
///   baseline_m                                        camera.baseline_m, of a rectified pair
///   vehicle_from_cam: {position_m, quaternion}        vehicle_from_cam.position, .orientation
///
///   camera_matrix, distortion_coefficients: {data}, image_width, image_height, [distortion_model:
///   plumb_bob, rational_polynomial or equidistant]           of OpenCV and ROS
///
///   cam0: {camera_model: pinhole, intrinsics, distortion_model: radtan or equidistant,
///   distortion_coeffs, resolution}                           of Kalibr
///
///   camera_model: pinhole, intrinsics, distortion_model: radial-tangential or equidistant,
///   distortion_coefficients, resolution                      of a sensor of EuRoC
///
/// Of the last three what is not of the camera itself is left out, and so is `sigma_px`, for
/// `alidade bundle`.
///
/// Errors       kBadData with file, line and column; kInputMissing.
Config ReadCalibrationFile(const std::filesystem::path& file);

}  // namespace alidade
