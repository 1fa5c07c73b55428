// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <string>
#include <utility>
#include <vector>

#include "alidade/base/error.h"
#include "alidade/record/images.h"

namespace alidade {

/// The image of one frame: on black a white disc of radius 4 px at each of the pixels (u, v),
/// placed to 1/256 px, and the frame's number in dark grey at the lower left. The centre of the
/// upper left pixel is (0, 0).
inline cv::Mat Draw(std::int64_t number, const std::vector<std::array<double, 2>>& pixels,
                    int width, int height) {
  constexpr int kShift = 8, kRadius = 4;  // bits behind the point; px
  constexpr double kOne = 1 << kShift, kMargin = kRadius + 1.0;
  const cv::Scalar white(255, 255, 255), grey(50, 50, 50);
  cv::Mat image(height, width, CV_8UC3, cv::Scalar());
  cv::putText(image, std::to_string(number), {4, height - 5}, cv::FONT_HERSHEY_PLAIN, 1.0, grey);
  for (const auto& [u, v] : pixels) {
    const bool seen = u > -kMargin && u < width + kMargin && v > -kMargin && v < height + kMargin;
    if (!seen) continue;
    const cv::Point centre(cvRound(u * kOne), cvRound(v * kOne));
    cv::circle(image, centre, kRadius << kShift, white, cv::FILLED, cv::LINE_AA, kShift);
  }
  return image;
}

/// A writer of images of either kind.
class MatWriter : public ImageWriter {
 public:
  explicit MatWriter(ImageArguments arguments) : to_(std::move(arguments)) {}

  void Add(std::int64_t number, Timestamp timestamp,
           const std::vector<std::array<double, 2>>& pixels) override {
    Write(number, timestamp, Draw(number, pixels, to_.width, to_.height));
  }
  void Add(std::int64_t number, Timestamp timestamp, const GreyImage& image) override {
    cv::Mat grey(image.height, image.width, CV_8UC1);
    std::ranges::copy(image.pixels, grey.begin<unsigned char>());
    Write(number, timestamp, grey);
  }

 protected:
  virtual void Write(std::int64_t number, Timestamp timestamp, const cv::Mat& image) = 0;
  const ImageArguments& to() const { return to_; }

 private:
  ImageArguments to_;
};

/// One PNG for each frame, `000000.png` and so on.
class ImageSequenceWriter : public MatWriter {
 public:
  using MatWriter::MatWriter;
  void Close() override {}

 private:
  void Write(std::int64_t number, Timestamp /*timestamp*/, const cv::Mat& image) override {
    std::vector<unsigned char> bytes;
    cv::imencode(".png", image, bytes);
    char name[32];
    std::snprintf(name, sizeof name, "%06lld.png", static_cast<long long>(number));
    std::ofstream file(to().path / name, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    file.close();
    if (file) return;
    throw Error(ExitCode::kIo, ErrorLine({to().shown + '/' + name}, {}, "cannot be written"));
  }
};

/// A video, MJPG in AVI, of as many frames a second as the first two are apart, to whole numbers
/// from 1; of a single frame 30.
class VideoWriter : public MatWriter {
 public:
  static constexpr double kRateOfOne = 30.0;  ///< where two frames do not tell

  using MatWriter::MatWriter;

  /// The writer of OpenCV does not tell of a full disk; the index, which is written last, does.
  void Close() override {
    if (count_ == 0) return;
    if (!video_.isOpened()) Open(kRateOfOne);
    video_.release();
    const cv::VideoCapture written(to().path.string(), cv::CAP_OPENCV_MJPEG);
    if (written.isOpened() && written.get(cv::CAP_PROP_FRAME_COUNT) == count_) return;
    throw Error(ExitCode::kIo, ErrorLine({to().shown}, {}, "cannot be written in full"));
  }

 private:
  void Write(std::int64_t /*number*/, Timestamp timestamp, const cv::Mat& given) override {
    cv::Mat image = given;
    if (image.channels() == 1) cv::cvtColor(given, image, cv::COLOR_GRAY2BGR);
    if (count_++ == 0) {
      first_ = image;
      first_timestamp_ = timestamp;
      return;
    }
    if (!video_.isOpened()) {
      const double gap_s = Seconds(timestamp - first_timestamp_);
      Open(gap_s > 0.0 ? std::round(1.0 / gap_s) : kRateOfOne);
    }
    video_.write(image);
  }
  void Open(double rate_hz) {
    const int fourcc = cv::VideoWriter::fourcc('M', 'J', 'P', 'G');
    video_.open(to().path.string(), cv::CAP_OPENCV_MJPEG, fourcc, std::max(rate_hz, 1.0),
                first_.size());
    if (!video_.isOpened()) {
      throw Error(ExitCode::kCannotCreate, ErrorLine({to().shown}, {}, "cannot be created"));
    }
    video_.write(first_);
  }

  cv::VideoWriter video_;
  cv::Mat first_;
  Timestamp first_timestamp_ = 0;
  int count_ = 0;
};

}  // namespace alidade
