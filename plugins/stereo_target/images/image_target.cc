// SPDX-License-Identifier: Apache-2.0
#include "image_target.h"

#include <opencv2/core/utils/logger.hpp>

#include "alidade/host/cpp_plugin.h"

namespace alidade {
namespace {

std::unique_ptr<Source> Create(const SourceArguments& arguments) {
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  return std::make_unique<ImageTarget>(arguments);
}

}  // namespace
}  // namespace alidade

// Opened by the source stereo_target in stereo_target.cc, which has the texts.
ALIDADE_SOURCE_PLUGIN({"image_target", "", "", &alidade::Create})
