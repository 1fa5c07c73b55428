// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "alidade/base/error.h"
#include "plugins/common/companion_files.h"

namespace alidade {

/// When images were taken: by a table `frame,t_s` that has each of them, or at a rate.
///
/// Errors       kBadData: an image without a time, a time without an image. An image that is gone
///              would give those after it the times of others.
class ImageTimes {
 public:
  explicit ImageTimes(double rate_hz) : rate_hz_(rate_hz) {}
  ImageTimes(const std::filesystem::path& table, const Node& key) {
    rows_.emplace(table, key.place(), key.path());
  }

  /// Of image `number`, from 0; asked for in order.
  Timestamp At(std::int64_t number) {
    if (!rows_) return TimestampFromSeconds(static_cast<double>(number) / rate_hz_);
    std::int64_t frame = -1;
    Timestamp timestamp = 0;
    while (frame < number && rows_->Next(frame, timestamp)) continue;
    if (frame != number) Fail("has no time for image " + std::to_string(number));
    return timestamp;
  }
  /// After the last of all images.
  void End(std::int64_t count) {
    std::int64_t frame = 0;
    Timestamp timestamp = 0;
    if (!rows_ || !rows_->Next(frame, timestamp)) return;
    Fail("has a time for image " + std::to_string(frame) + ", but there are " +
         std::to_string(count) + " images");
  }

 private:
  [[noreturn]] void Fail(const std::string& what) const {
    throw Error(ExitCode::kBadData,
                ErrorLine({rows_->name()}, {}, what, "a time for each image, counted from 0"));
  }

  double rate_hz_ = 0.0;
  std::optional<TimestampRows> rows_;
};

}  // namespace alidade
