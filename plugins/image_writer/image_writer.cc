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

/// One PNG for each frame, `000000.png` and so on.
class ImageSequenceWriter : public MatWriter {
 public:
  explicit ImageSequenceWriter(const ImageArguments& arguments)
      : MatWriter(arguments.width, arguments.height), to_(arguments) {}
  void Close() override {}

 private:
  void Write(std::int64_t number, Timestamp /*timestamp*/, const cv::Mat& image) override {
    std::vector<unsigned char> bytes;
    cv::imencode(".png", image, bytes);
    char name[32];
    std::snprintf(name, sizeof name, "%06lld.png", static_cast<long long>(number));
    std::ofstream file(to_.path / name, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    file.close();
    if (file) return;
    throw Error(ExitCode::kIo, ErrorLine({to_.shown + '/' + name}, {}, "cannot be written"));
  }

  ImageArguments to_;
};

/// A video, MJPG in AVI, of as many frames a second as the first two are apart, to whole numbers
/// from 1; of a single frame 30. No image leaves no video. Errors: kCannotCreate, kIo.
class VideoWriter : public MatWriter {
 public:
  explicit VideoWriter(const ImageArguments& arguments)
      : MatWriter(arguments.width, arguments.height), to_(arguments) {}

  void Close() override {
    if (first_.empty()) return;
    if (!video_.isOpened()) Open(kRateOfOne);
    video_.release();
    if (IsComplete()) return;
    throw Error(ExitCode::kIo, ErrorLine({to_.shown}, {}, "cannot be written in full"));
  }

 private:
  static constexpr double kRateOfOne = 30.0;  ///< Hz, of a single frame

  /// All images are as large as the first.
  void Write(std::int64_t /*number*/, Timestamp timestamp, const cv::Mat& image) override {
    if (first_.empty()) {
      first_ = image;
      first_timestamp_ = timestamp;
      return;
    }
    if (!video_.isOpened()) {
      const double gap_s = Seconds(timestamp - first_timestamp_);
      constexpr double kMaxRate = 1e6;
      Open(gap_s > 0.0 ? std::clamp(std::round(1.0 / gap_s), 1.0, kMaxRate) : kRateOfOne);
    }
    Encode(image);
  }
  void Open(double rate_hz) {
    const int fourcc = cv::VideoWriter::fourcc('M', 'J', 'P', 'G');
    if (!video_.open(to_.path.string(), cv::CAP_OPENCV_MJPEG, fourcc, rate_hz, first_.size())) {
      throw Error(ExitCode::kCannotCreate, ErrorLine({to_.shown}, {}, "cannot be created",
                                                     "OpenCV with its writer of Motion JPEG"));
    }
    constexpr double kQuality = 90.0;  // as good as JPEG files of quality 95 by imencode
    video_.set(cv::VIDEOWRITER_PROP_QUALITY, kQuality);
    Encode(first_);
  }
  void Encode(const cv::Mat& image) {
    cv::Mat colour = image;  // grey images are not encoded right by OpenCV 4.6
    if (image.channels() == 1) cv::cvtColor(image, colour, cv::COLOR_GRAY2BGR);
    video_.write(colour);
  }
  /// Whether the file is as long as its RIFF header says: OpenCV reports no write that fails.
  bool IsComplete() const {
    constexpr std::uintmax_t kHead = 8;  // bytes "RIFF" and the number of those that follow
    unsigned char head[kHead] = {};
    std::ifstream(to_.path, std::ios::binary).read(reinterpret_cast<char*>(head), sizeof head);
    std::uintmax_t size = 0;
    for (int i = 7; i >= 4; --i) size = size << 8U | head[i];
    std::error_code error;
    return std::filesystem::file_size(to_.path, error) == kHead + size && !error;
  }

  ImageArguments to_;
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
