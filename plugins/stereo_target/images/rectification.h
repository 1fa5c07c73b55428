// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstring>
#include <filesystem>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "alidade/base/error.h"
#include "alidade/config/config.h"
#include "alidade/io/read_file.h"

namespace alidade {

/// Rectification of a calibrated pair: converts the images of the pair to those of two pinhole
/// cameras side by side (cv::stereoRectify). A point is then in the same row of both images.
///
///   entry of the file   shape       unit  meaning
///   M1, M2              3x3         px    camera matrix, left and right
///   D1, D2              4 to 14     -     k1 k2 p1 p2 [k3 [k4 k5 k6 ...]], in OpenCV's order
///   R, T                3x3, 3x1    -, m  right_from_left
///
/// Errors       kInputMissing; kBadData with the file, if an entry is missing or has a wrong shape.
class Rectification {
 public:
  Rectification(const std::filesystem::path& file, const Node& key, cv::Size size) {
    const std::string text = internal::ReadFile(file, [&](ExitCode code, int error) {
      throw Error(code,
                  ErrorLine(key.place(), key.path(), file.string() + ": " + std::strerror(error)));
    });
    cv::Mat m1, d1, m2, d2, r, t;
    try {
      const cv::FileStorage storage(text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
      const auto read = [&](const char* name) {
        cv::Mat matrix;
        storage[name] >> matrix;
        if (matrix.empty()) Fail(file, std::string("there is no matrix '") + name + "'");
        matrix.convertTo(matrix, CV_64F);
        if (!cv::checkRange(matrix)) Fail(file, std::string("'") + name + "' is not finite");
        return matrix;
      };
      m1 = read("M1");
      d1 = read("D1");
      m2 = read("M2");
      d2 = read("D2");
      r = read("R");
      t = read("T");
      const auto expect = [&](const cv::Mat& matrix, cv::Size shape, const char* name) {
        if (matrix.size() != shape) Fail(file, std::string("'") + name + "' has a wrong shape");
      };
      expect(m1, {3, 3}, "M1");
      expect(m2, {3, 3}, "M2");
      expect(r, {3, 3}, "R");
      if (t.total() != 3) Fail(file, "'T' has a wrong shape");
      if (!(cv::norm(r * r.t(), cv::Mat::eye(3, 3, CV_64F), cv::NORM_INF) < 1e-3)) {
        Fail(file, "'R' is not a rotation");
      }
      cv::Mat r1, r2, p1, p2, q;
      cv::stereoRectify(m1, d1, m2, d2, size, r, t, r1, r2, p1, p2, q, cv::CALIB_ZERO_DISPARITY,
                        0.0);
      constexpr int kKind = CV_32FC1;
      cv::initUndistortRectifyMap(m1, d1, r1, p1, size, kKind, map_[0][0], map_[0][1]);
      cv::initUndistortRectifyMap(m2, d2, r2, p2, size, kKind, map_[1][0], map_[1][1]);
      camera_ = {m1, d1, r1, p1};
      intrinsics_ = p1.colRange(0, 3);
      baseline_m_ = -p2.at<double>(0, 3) / p2.at<double>(0, 0);
    } catch (const cv::Exception& error) {
      Fail(file, "OpenCV cannot read this calibration: " + error.err);
    }
    if (!(baseline_m_ > 0.0)) {
      Fail(file, "the right camera is not to the right of the left camera");
    }
    size_ = size;
  }

  /// Returns the rectified image. `view` is 0 for a left image, 1 for a right image.
  cv::Mat Rectify(const cv::Mat& image, int view) const {
    cv::Mat rectified;
    cv::remap(image, rectified, map_[view][0], map_[view][1], cv::INTER_LINEAR);
    return rectified;
  }
  /// Converts a pixel of the original left image to its position in the rectified left image.
  cv::Point2f Rectify(cv::Point2f pixel) const {
    std::vector<cv::Point2f> rectified;
    cv::undistortPoints(std::vector<cv::Point2f>{pixel}, rectified, camera_.matrix,
                        camera_.distortion, camera_.rotation, camera_.projection);
    return rectified[0];
  }
  /// Returns the camera matrix of both rectified cameras.
  const cv::Matx33d& intrinsics() const { return intrinsics_; }
  /// Returns the calibration of the rectified pair, in the form of Source::Calibration.
  Config Calibration(const std::string& origin) const {
    Config config = Config::FromText("calibration: {}", origin);
    const auto set = [&](const std::string& key, double value) {
      config.Set("calibration." + key, cv::format("%.17g", value), origin);
    };
    set("focal_px", intrinsics_(0, 0));
    set("baseline_m", baseline_m_);
    set("camera.fx", intrinsics_(0, 0));
    set("camera.fy", intrinsics_(1, 1));
    set("camera.cx", intrinsics_(0, 2));
    set("camera.cy", intrinsics_(1, 2));
    set("camera.baseline_m", baseline_m_);
    config.Set("calibration.camera.width", std::to_string(size_.width), origin);
    config.Set("calibration.camera.height", std::to_string(size_.height), origin);
    config.Set("calibration.camera.model", "pinhole", origin);
    return config;
  }

 private:
  [[noreturn]] static void Fail(const std::filesystem::path& file, const std::string& problem) {
    throw Error(ExitCode::kBadData, ErrorLine({file.string()}, {}, problem,
                                              "M1, D1, M2, D2, R and T of cv::stereoCalibrate, "
                                              "with T in m"));
  }

  struct LeftCamera {
    cv::Mat matrix, distortion, rotation, projection;
  };
  cv::Mat map_[2][2];
  LeftCamera camera_;
  cv::Matx33d intrinsics_;
  double baseline_m_ = 0.0;
  cv::Size size_;
};

}  // namespace alidade
