// SPDX-License-Identifier: Apache-2.0
#include "plugins/common/images/start_frame.h"

#include "alidade/base/error.h"

namespace alidade {

StartFrame::StartFrame(Params& p, const Node& entry)
    : number_(p.Integer("start_frame", "first image; earlier images are skipped", 0, 1 << 30, 0)) {
  if (const auto node = entry.Find("start_frame")) {
    place_ = node->place();
    path_ = node->path();
  }
}

void StartFrame::Check(std::int64_t count) const {
  if (number_ == 0 || number_ < count) return;
  const std::string images = count == 1 ? " image" : " images";
  throw Error(ExitCode::kBadConfig,
              ErrorLine(place_, path_,
                        "image " + std::to_string(number_) + " does not exist; the source has " +
                            std::to_string(count) + images + ", counted from 0",
                        "at most " + std::to_string(std::max<std::int64_t>(0, count - 1))));
}

void StartFrame::Check(const ImageReader& images) const {
  if (!images.is_video()) Check(images.size());
}

}  // namespace alidade
