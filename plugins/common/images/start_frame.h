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
  StartFrame(Params& p, const Node& entry);

  std::int64_t number() const { return number_; }
  /// Of that many images, those from it on.
  std::int64_t Left(std::int64_t count) const { return std::max<std::int64_t>(0, count - number_); }
  /// Fails where images of that number end before it. Errors: kBadConfig.
  void Check(std::int64_t count) const;
  /// The same as soon as it is known: of a folder; a video says what it has at its end alone.
  void Check(const ImageReader& images) const;

 private:
  std::int64_t number_;
  Place place_;
  std::string path_;
};

}  // namespace alidade
