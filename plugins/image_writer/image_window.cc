// SPDX-License-Identifier: Apache-2.0
#include <opencv2/core/utils/logger.hpp>

#include "alidade/record/images.h"
#include "mat_writer.h"
#include "window_process.h"

namespace alidade {
namespace {

/// Writer that shows each image in a window. Closing the window does not end the run.
class WindowWriter : public MatWriter {
 public:
  explicit WindowWriter(const ImageArguments& arguments)
      : MatWriter(arguments.width, arguments.height),
        window_(arguments.path.string(), arguments.shown) {}
  void Close() override {}

 private:
  void Write(std::int64_t /*number*/, Timestamp /*timestamp*/, const cv::Mat& image) override {
    window_.Show(image);
  }

  WindowProcess window_;
};

std::unique_ptr<ImageWriter> Create(const ImageArguments& arguments) {
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  return std::make_unique<WindowWriter>(arguments);
}

}  // namespace
}  // namespace alidade

ALIDADE_IMAGE_PLUGIN(&alidade::Create)
