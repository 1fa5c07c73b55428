// SPDX-License-Identifier: Apache-2.0
#include "image_writer.h"

#include <opencv2/core/utils/logger.hpp>

#include "alidade/host/cpp_plugin.h"

namespace alidade {
namespace {

std::unique_ptr<ImageWriter> Create(const ImageArguments& arguments) {
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  if (arguments.form == ImageArguments::Form::kVideo) {
    return std::make_unique<VideoWriter>(arguments);
  }
  return std::make_unique<ImageSequenceWriter>(arguments);
}

}  // namespace
}  // namespace alidade

ALIDADE_IMAGE_PLUGIN(&alidade::Create)
