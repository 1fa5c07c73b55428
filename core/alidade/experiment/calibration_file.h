// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "alidade/config/config.h"

namespace alidade {

/// Options of ReadCalibrationFile().
struct CalibrationOptions {
  /// Camera to read from a file of several cameras: `cam0`, `cam1` (Kalibr), `Camera1`, `Camera2`
  /// (ORB-SLAM). Empty: the first camera.
  std::string entry = {};
  bool noise = false;  ///< true: also reads the keys `sigma_px` and `covariance`
};

/// Reads the calibration of a camera, and converts it to the keys that models use. The result is a
/// config with the map `calibration`, as in Source::Calibration(). A key of the file determines
/// its form:
///
///   form               recognised by      model of the camera
///   alidade            camera             camera: {model, width, height, fx, ...}
///   rectified pair     intrinsics_px      pinhole; image: {width, height}, baseline_m,
///                                         vehicle_from_cam: {position_m, quaternion}
///   Kalibr             cam0               pinhole with radtan, equidistant or none
///   EuRoC              intrinsics         pinhole with radial-tangential, equidistant or none
///   OpenCV, ROS file   camera_matrix      plumb_bob, rational_polynomial, equidistant; without
///                                         distortion_model, the number of coefficients decides
///   ROS message        K or k             likewise; as `rostopic echo`, `ros2 topic echo` print it
///   VINS, camodocal    model_type         PINHOLE, PINHOLE_FULL, KANNALA_BRANDT
///   ORB-SLAM2, 3       Camera.fx or       PinHole, KannalaBrandt8, Rectified
///                      Camera1.fx
///
/// Only the first YAML document is read. Distortion whose coefficients are all 0 yields a pinhole,
/// except for equidistant. The first two forms must not contain other keys, except `sigma_px` and
/// `covariance`. The other forms may contain any keys. The image size may be missing in the form of
/// ORB-SLAM; the model then requires `camera.width` and `camera.height` from the config. A file may
/// `include` another file, as a config may.
///
/// Errors       kBadData with file, line and column: the text is not YAML, the form is unknown, or
///              no camera model here equals the calibrated one (omni, skew). kInputMissing.
Config ReadCalibrationFile(const std::filesystem::path& file,
                           const CalibrationOptions& options = {});

}  // namespace alidade
