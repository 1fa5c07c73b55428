// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>

#include "alidade/config/config.h"
#include "alidade/model/params.h"
#include "plugins/common/images/image_reader.h"

namespace alidade {

/// Key `start_frame` of a source of images: the number of the first image. Earlier images are
/// skipped.
class StartFrame {
 public:
  StartFrame(Params& p, const Node& entry);

  std::int64_t number() const { return number_; }
  /// Returns the number of images that remain if the source has `count` images.
  std::int64_t Remaining(std::int64_t count) const {
    return std::max<std::int64_t>(0, count - number_);
  }
  /// Checks that a source of `count` images contains image `start_frame`. Error: kBadConfig.
  void Check(std::int64_t count) const;
  /// Checks the images of a folder before they are read. Does not check a video, because its number
  /// of images is known only at its end.
  void Check(const ImageReader& images) const;

 private:
  std::int64_t number_;
  Place place_;
  std::string path_;
};

}  // namespace alidade
