// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/config/config.h"

namespace alidade {

/// Reads 8-bit grey images, one at a time, from a folder, a video or a live camera. The images of a
/// folder are read in the order of their names (2.png before 10.png). A camera is a device such as
/// /dev/video0.
///
/// Errors       kInputMissing if the path does not exist, or the folder has no images. kBadData,
///              with the file, if an image cannot be decoded, is incomplete, or does not have the
///              size of the first image.
class ImageReader {
 public:
  /// `names` is a shell pattern of the image files in a folder. If `names` is empty, the endings of
  /// the file names determine which files are images.
  ImageReader(std::filesystem::path path, const std::string& names, const Node& key);

  /// Reads the next image. Returns false at the end.
  bool Next(cv::Mat& image);

  bool is_video() const { return files_.empty(); }
  /// Returns true for a camera. Next() then captures an image, and never returns false.
  bool is_live() const { return is_live_; }
  /// Returns the number of the last image, counted from 0.
  std::int64_t number() const { return number_; }
  /// Returns the place of the last image: its file, or the video and the number of the image.
  Place place() const;
  /// Returns the file name of image k; "" for a video.
  std::string name(std::int64_t k) const;
  /// Returns the number of images: for a video, the number that its header states; for a camera, 0.
  std::int64_t size() const;
  /// Returns the frame rate that a video states, Hz. Returns 0 for a folder or a camera.
  double rate_hz() const { return is_video() && !is_live_ ? video_.get(cv::CAP_PROP_FPS) : 0.0; }

 private:
  /// Returns true if the name has the ending of an image file. The content does not matter, because
  /// an empty or broken image is an error and must not be skipped.
  static bool EndsLikeAnImage(const std::filesystem::path& file);

  void List(const std::string& names, const Node& key);

  bool ReadVideo(cv::Mat& image);

  bool ReadFile(cv::Mat& image);

  /// Returns true if the end of a PNG or JPEG file is missing. This function is needed because the
  /// JPEG decoder replaces missing data without an error, and the PNG decoder prints a message on
  /// stderr.
  static bool IsCutShort(std::string_view bytes);

  [[noreturn]] void Fail(const std::string& what, std::string_view expected) const;

  std::filesystem::path path_;
  std::vector<std::filesystem::path> files_;  ///< images of a folder; empty for a video
  cv::VideoCapture video_;
  bool is_live_ = false;
  cv::Mat colour_;
  cv::Size size_;
  std::int64_t number_ = -1;
};

}  // namespace alidade
