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
/// Errors       kInputMissing: no such path, or no image in the folder. kBadData, with the file: an
///              image that cannot be decoded, is cut short, or has another size than the first.
class ImageReader {
 public:
  /// `names` is a shell pattern of the image files in a folder. If it is empty, the endings of the
  /// names determine which files are images.
  ImageReader(std::filesystem::path path, const std::string& names, const Node& key);

  /// Reads the next image. Returns false at the end.
  bool Next(cv::Mat& image);

  bool is_video() const { return files_.empty(); }
  /// Returns true for a camera. Next() then captures an image, and never returns false.
  bool is_live() const { return is_live_; }
  /// Returns the number of the last image, counted from 0.
  std::int64_t number() const { return number_; }
  /// Returns the file of the last image, or its number in the video.
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

  /// Returns true if the end of a PNG or JPEG file is missing. The JPEG decoder replaces missing
  /// data without an error, and the PNG decoder prints a line of its own on stderr.
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
