// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>

#include "alidade/config/config.h"
#include "alidade/model/params.h"
#include "plugins/common/images/image_reader.h"

namespace alidade {

/// Key `start_frame` of a source of images. The images before it are skipped.
class StartFrame {
 public:
  StartFrame(Params& p, const Node& entry);

  std::int64_t number() const { return number_; }
  /// Returns the number of images of `count` that remain.
  std::int64_t Remaining(std::int64_t count) const {
    return std::max<std::int64_t>(0, count - number_);
  }
  /// Fails if `count` images end before it. Errors: kBadConfig.
  void Check(std::int64_t count) const;
  /// Checks the images of a folder before they are read. A video only reports its size at its end.
  void Check(const ImageReader& images) const;

 private:
  std::int64_t number_;
  Place place_;
  std::string path_;
};

}  // namespace alidade
