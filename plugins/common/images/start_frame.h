// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>

#include "alidade/config/config.h"
#include "alidade/model/params.h"
#include "plugins/common/images/image_reader.h"

namespace alidade {

/// The key `start_frame` of a source of images: those before it are left out.
class StartFrame {
 public:
  StartFrame(Params& p, const Node& entry)
      : number_(p.Integer("start_frame", "images before it are left out", 0, 1 << 30, 0)) {
    if (const auto node = entry.Find("start_frame")) {
      place_ = node->place();
      path_ = node->path();
    }
  }

  std::int64_t number() const { return number_; }
  /// Of that many images, those from it on.
  std::int64_t Left(std::int64_t count) const { return std::max<std::int64_t>(0, count - number_); }
  /// Fails where images of that number end before it. Errors: kBadConfig.
  void Check(std::int64_t count) const {
    if (number_ == 0 || number_ < count) return;
    const std::string images = count == 1 ? " image" : " images";
    throw Error(ExitCode::kBadConfig,
                ErrorLine(place_, path_,
                          std::to_string(number_) + ", but there are " + std::to_string(count) +
                              images + ", counted from 0",
                          "at most " + std::to_string(std::max<std::int64_t>(0, count - 1))));
  }
  /// The same as soon as it is known: of a folder; a video says what it has at its end alone.
  void Check(const ImageReader& images) const {
    if (!images.is_video()) Check(images.size());
  }

 private:
  std::int64_t number_;
  Place place_;
  std::string path_;
};

}  // namespace alidade
