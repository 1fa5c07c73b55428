// SPDX-License-Identifier: Apache-2.0
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/highgui.hpp>

#include "alidade/base/error.h"
#include "alidade/host/cpp_plugin.h"
#include "mat_writer.h"

namespace alidade {
namespace {

/// A window that shows each image as it comes. Closing it does not end the run.
class WindowWriter : public MatWriter {
 public:
  explicit WindowWriter(const ImageArguments& arguments) : MatWriter(arguments) {
    try {
      cv::namedWindow(title(), cv::WINDOW_NORMAL | cv::WINDOW_KEEPRATIO);
    } catch (const cv::Exception& error) {
      throw Error(ExitCode::kCannotCreate,
                  ErrorLine({to().shown}, {}, "no window can be opened: " + error.err,
                            "a display, as DISPLAY names it"));
    }
  }
  void Close() override {
    if (open_) cv::destroyWindow(title());
  }

 private:
  std::string title() const { return to().path.string(); }
  void Write(std::int64_t number, Timestamp /*timestamp*/, const cv::Mat& image) override {
    if (!open_) return;
    if (number == 0) cv::resizeWindow(title(), image.size());
    cv::imshow(title(), image);
    cv::waitKey(1);
    open_ = cv::getWindowProperty(title(), cv::WND_PROP_VISIBLE) > 0.0;
  }

  bool open_ = true;
};

std::unique_ptr<ImageWriter> Create(const ImageArguments& arguments) {
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  return std::make_unique<WindowWriter>(arguments);
}

}  // namespace
}  // namespace alidade

ALIDADE_IMAGE_PLUGIN(&alidade::Create)
