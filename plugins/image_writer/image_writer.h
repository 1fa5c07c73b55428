// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <vector>

#include "alidade/base/error.h"
#include "avi_file.h"
#include "mat_writer.h"

namespace alidade {

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
/// from 1; of a single frame 30. No image leaves no video.
class VideoWriter : public MatWriter {
 public:
  static constexpr std::uint32_t kRateOfOne = 30;  ///< where two frames do not tell

  using MatWriter::MatWriter;

  void Close() override {
    if (first_.empty()) return;
    if (!video_) Open(kRateOfOne);
    video_->Close();
  }

 private:
  /// All images are as large as the first.
  void Write(std::int64_t /*number*/, Timestamp timestamp, const cv::Mat& image) override {
    if (first_.empty()) {
      first_ = image;
      first_timestamp_ = timestamp;
      return;
    }
    if (!video_) {
      const double gap_s = Seconds(timestamp - first_timestamp_);
      constexpr double kMost = 1e6;
      Open(gap_s > 0.0 ? static_cast<std::uint32_t>(std::clamp(std::round(1.0 / gap_s), 1.0, kMost))
                       : kRateOfOne);
    }
    Encode(image);
  }
  void Open(std::uint32_t rate_hz) {
    video_.emplace(to().path, to().shown, first_.cols, first_.rows, rate_hz);
    Encode(first_);
  }
  void Encode(const cv::Mat& image) {
    std::vector<unsigned char> jpeg;
    cv::imencode(".jpg", image, jpeg);
    video_->Add(jpeg);
  }

  std::optional<AviFile> video_;
  cv::Mat first_;
  Timestamp first_timestamp_ = 0;
};

}  // namespace alidade
