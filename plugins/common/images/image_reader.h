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

/// The images of a folder, in the order of their names (2.png before 10.png), of a video, or of a
/// camera (a device, /dev/video0) as it takes them; one at a time, 8 bit grey.
///
/// Errors       kInputMissing: no such path, no image in the folder. kBadData, with the file: an
///              image that cannot be decoded, is cut short, or has another size than the first.
class ImageReader {
 public:
  /// `names`: which files of a folder are images, as a shell matches names; empty: those that end
  /// like one.
  ImageReader(std::filesystem::path path, const std::string& names, const Node& key);

  /// The next image; false at the end.
  bool Next(cv::Mat& image);

  bool is_video() const { return files_.empty(); }
  /// A camera: an image is taken when it is asked for, and there is no last one.
  bool is_live() const { return is_live_; }
  /// Of the image that was read last, from 0.
  std::int64_t number() const { return number_; }
  /// The file of the image that was read last, or its number in the video.
  Place place() const;
  /// Of the file of image k; empty: of a video.
  std::string name(std::int64_t k) const;
  /// How many there are; of a video as it says; 0 of a camera.
  std::int64_t size() const;
  /// Images a second, as a video says; 0: it does not.
  double rate_hz() const { return is_video() && !is_live_ ? video_.get(cv::CAP_PROP_FPS) : 0.0; }

 private:
  /// By the name alone: an empty or broken image is an error, and not passed over.
  static bool EndsLikeAnImage(const std::filesystem::path& file);

  void List(const std::string& names, const Node& key);

  bool ReadVideo(cv::Mat& image);

  bool ReadFile(cv::Mat& image);

  /// The decoder of JPEG fills up what is not there, and says nothing; that of PNG writes a line of
  /// its own to stderr, as it does of one that is damaged otherwise.
  static bool IsCutShort(std::string_view bytes);

  [[noreturn]] void Fail(const std::string& what, std::string_view expected) const;

  std::filesystem::path path_;
  std::vector<std::filesystem::path> files_;  ///< of a folder
  cv::VideoCapture video_;
  bool is_live_ = false;
  cv::Mat colour_;
  cv::Size size_;
  std::int64_t number_ = -1;
};

}  // namespace alidade
