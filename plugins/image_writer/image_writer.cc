// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <vector>

#include "alidade/base/error.h"
#include "alidade/record/images.h"
#include "mat_writer.h"

namespace alidade {
namespace {

/// Writer of a PNG file for each frame, `000000.png`, `000001.png`, ...
class ImageSequenceWriter : public MatWriter {
 public:
  explicit ImageSequenceWriter(const ImageArguments& arguments)
      : MatWriter(arguments.width, arguments.height), destination_(arguments) {}
  void Close() override {}

 private:
  void Write(std::int64_t number, Timestamp /*timestamp*/, const cv::Mat& image) override {
    std::vector<unsigned char> bytes;
    cv::imencode(".png", image, bytes);
    char name[32];
    std::snprintf(name, sizeof name, "%06lld.png", static_cast<long long>(number));
    std::ofstream file(destination_.path / name, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    file.close();
    if (file) return;
    throw Error(ExitCode::kIo,
                ErrorLine({destination_.shown + '/' + name}, {}, "the file cannot be written"));
  }

  ImageArguments destination_;
};

/// Writer of a video with MJPG images in an AVI file. The frame rate follows from the times of the
/// first two frames, and is rounded to a whole number of at least 1 Hz. A video of a single frame
/// has 30 Hz. If there is no image, no video is written. Errors: kCannotCreate, kIo.
class VideoWriter : public MatWriter {
 public:
  explicit VideoWriter(const ImageArguments& arguments)
      : MatWriter(arguments.width, arguments.height), destination_(arguments) {}

  void Close() override {
    if (first_.empty()) return;
    if (!video_.isOpened()) Open(kSingleFrameRate);
    video_.release();
    if (IsComplete()) return;
    throw Error(ExitCode::kIo,
                ErrorLine({destination_.shown}, {}, "the video cannot be written completely"));
  }

 private:
  static constexpr double kSingleFrameRate = 30.0;  ///< frame rate of a single frame, Hz

  /// All images have the size of the first image.
  void Write(std::int64_t /*number*/, Timestamp timestamp, const cv::Mat& image) override {
    if (first_.empty()) {
      first_ = image;
      first_timestamp_ = timestamp;
      return;
    }
    if (!video_.isOpened()) {
      const double gap_s = Seconds(timestamp - first_timestamp_);
      constexpr double kMaxRate = 1e6;
      Open(gap_s > 0.0 ? std::clamp(std::round(1.0 / gap_s), 1.0, kMaxRate) : kSingleFrameRate);
    }
    Encode(image);
  }
  void Open(double rate_hz) {
    const int fourcc = cv::VideoWriter::fourcc('M', 'J', 'P', 'G');
    if (!video_.open(destination_.path.string(), cv::CAP_OPENCV_MJPEG, fourcc, rate_hz,
                     first_.size())) {
      throw Error(ExitCode::kCannotCreate,
                  ErrorLine({destination_.shown}, {}, "the video cannot be created",
                            "OpenCV with its Motion JPEG writer"));
    }
    constexpr double kQuality = 90.0;  // equals quality 95 of cv::imencode
    video_.set(cv::VIDEOWRITER_PROP_QUALITY, kQuality);
    Encode(first_);
  }
  void Encode(const cv::Mat& image) {
    cv::Mat colour = image;  // OpenCV 4.6 encodes grey images incorrectly
    if (image.channels() == 1) cv::cvtColor(image, colour, cv::COLOR_GRAY2BGR);
    video_.write(colour);
  }
  /// Returns true if the file is as long as its RIFF header states. OpenCV does not report failed
  /// writes.
  bool IsComplete() const {
    constexpr std::uintmax_t kHeaderSize = 8;  // "RIFF" and the number of remaining bytes
    unsigned char header[kHeaderSize] = {};
    std::ifstream(destination_.path, std::ios::binary)
        .read(reinterpret_cast<char*>(header), sizeof header);
    std::uintmax_t size = 0;
    for (int i = 7; i >= 4; --i) size = size << 8U | header[i];
    std::error_code error;
    return std::filesystem::file_size(destination_.path, error) == kHeaderSize + size && !error;
  }

  ImageArguments destination_;
  cv::VideoWriter video_;
  cv::Mat first_;
  Timestamp first_timestamp_ = 0;
};

std::unique_ptr<ImageWriter> Create(const ImageArguments& arguments) {
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  if (arguments.form == ImageArguments::Form::kVideo) {
    return std::make_unique<VideoWriter>(arguments);
  }
  return std::make_unique<ImageSequenceWriter>(arguments);
}

}  // namespace
}  // namespace alidade

ALIDADE_IMAGE_PLUGIN(&alidade::Create)
