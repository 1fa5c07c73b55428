// SPDX-License-Identifier: Apache-2.0
#include "plugins/common/source_on_demand.h"

namespace alidade {
namespace {

constexpr const char* kStereoTargetKeys =
    "left          images of the left or the only camera: a folder, files such as "
    "'pairs/left*.jpg', or a video\n"
    "right         images of the right camera; default: no right camera, and no disparity\n"
    "stereo        OpenCV calibration file of the pair, with M1, D1, M2, D2, R and T (m); "
    "default: none, and the images must be rectified\n"
    "boxes         table of the target's boxes: frame,x,y,width,height, or frame and four "
    "corners x0,y0,...,x3,y3, px\n"
    "timestamps    table frame,t_s; default: rate_hz, or the rate of a video\n"
    "truth         table t_s,NAME,... of true values";

std::unique_ptr<Source> Create(const SourceArguments& arguments) {
  return CreateOnDemand("image_target", arguments);
}

}  // namespace
}  // namespace alidade

ALIDADE_SOURCE_PLUGIN({"stereo_target",
                       "disparity and apparent size of a target in images of a stereo pair",
                       alidade::kStereoTargetKeys, &alidade::Create})
