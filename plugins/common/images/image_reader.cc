// SPDX-License-Identifier: Apache-2.0
#include "plugins/common/images/image_reader.h"

#include <fnmatch.h>

#include <algorithm>
#include <cstring>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "alidade/base/error.h"
#include "alidade/io/read_file.h"
#include "plugins/common/images/camera_size.h"

namespace alidade {

ImageReader::ImageReader(std::filesystem::path path, const std::string& names, const Node& key)
    : path_(std::move(path)) {
  std::error_code error;
  if (!std::filesystem::exists(path_, error)) {
    throw Error(ExitCode::kInputMissing,
                ErrorLine(key.place(), key.path(), "no such file or folder: " + path_.string()));
  }
  if (std::filesystem::is_directory(path_, error)) {
    List(names, key);
    return;
  }
  is_live_ = std::filesystem::is_character_file(path_, error);
  if (!is_live_ && !std::filesystem::is_regular_file(path_, error)) {
    throw Error(ExitCode::kBadData, ErrorLine({path_.string()}, {},
                                              "this is not a regular file",  // such as a pipe
                                              "a video, a folder of images, or a camera"));
  }
  if (is_live_ ? video_.open(path_.string(), cv::CAP_V4L2) : video_.open(path_.string())) return;
  throw Error(
      ExitCode::kBadData,
      ErrorLine({path_.string()}, {},
                is_live_ ? "OpenCV cannot read this camera, or another program uses the camera"
                         : "OpenCV cannot read this file as a video",
                "a video, a folder of images, or a camera such as /dev/video0"));
}

bool ImageReader::Next(cv::Mat& image) {
  if (is_video() ? !ReadVideo(image) : !ReadFile(image)) return false;
  ++number_;
  if (size_.empty()) size_ = image.size();
  if (image.size() != size_) {
    Fail("the image is " + SizeText(image.size()) + ", but the first image is " + SizeText(size_),
         "images of the same size");
  }
  return true;
}

Place ImageReader::place() const {
  if (is_video()) return {path_.string() + ", image " + std::to_string(number_)};
  return {number_ < 0 ? path_.string() : files_[static_cast<std::size_t>(number_)].string()};
}

std::string ImageReader::name(std::int64_t k) const {
  return is_video() ? "" : files_[static_cast<std::size_t>(k)].filename().string();
}

std::int64_t ImageReader::size() const {
  if (is_live_) return 0;
  return is_video() ? static_cast<std::int64_t>(video_.get(cv::CAP_PROP_FRAME_COUNT))
                    : std::ssize(files_);
}

bool ImageReader::EndsLikeAnImage(const std::filesystem::path& file) {
  constexpr const char* kEnds[] = {".png", ".jpg", ".jpeg", ".pgm",  ".ppm",
                                   ".pnm", ".bmp", ".tif",  ".tiff", ".webp"};
  const std::string end = file.extension().string();
  return std::ranges::any_of(
      kEnds, [&](const char* ending) { return strcasecmp(end.c_str(), ending) == 0; });
}

void ImageReader::List(const std::string& names, const Node& key) {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(path_, error)) {
    const std::string name = entry.path().filename().string();
    const bool is_image = names.empty() ? EndsLikeAnImage(entry.path())
                                        : fnmatch(names.c_str(), name.c_str(), 0) == 0;
    std::error_code ignored;
    if (entry.is_regular_file(ignored) && is_image) files_.push_back(entry.path());
  }
  std::ranges::sort(files_, [](const auto& a, const auto& b) {
    return strverscmp(a.filename().c_str(), b.filename().c_str()) < 0;
  });
  if (error) {
    throw Error(ExitCode::kInputMissing,
                ErrorLine(key.place(), key.path(), path_.string() + ": " + error.message()));
  }
  if (!files_.empty()) return;
  throw Error(ExitCode::kInputMissing,
              ErrorLine(key.place(), key.path(),
                        "no image in " + path_.string() +
                            (names.empty() ? " was found" : " matches '" + names + "'"),
                        "PNG, JPEG, PGM or another format that OpenCV reads"));
}

bool ImageReader::ReadVideo(cv::Mat& image) {
  if (!video_.read(colour_)) return false;
  if (colour_.channels() == 1) {
    image = colour_;
  } else {
    cv::cvtColor(colour_, image, cv::COLOR_BGR2GRAY);
  }
  return true;
}

bool ImageReader::ReadFile(cv::Mat& image) {
  const auto next = static_cast<std::size_t>(number_ + 1);
  if (next == files_.size()) return false;
  const std::string bytes = internal::ReadFile(files_[next], [&](ExitCode code, int error) {
    throw Error(code, ErrorLine({files_[next].string()}, {}, std::strerror(error)));
  });
  const bool is_cut = IsCutShort(bytes);
  if (!bytes.empty() && !is_cut) {
    const cv::Mat buffer(1, static_cast<int>(bytes.size()), CV_8UC1,
                         const_cast<char*>(bytes.data()));
    try {
      image.release();  // imdecode keeps the old image if no decoder accepts the file
      cv::imdecode(buffer, cv::IMREAD_GRAYSCALE, &image);
    } catch (const cv::Exception&) {  // the size in the header exceeds OpenCV's limit
      image.release();
    }
  }
  if (bytes.empty() || is_cut) image.release();
  if (image.empty()) {
    ++number_;
    Fail(bytes.empty() ? "the file is empty"
         : is_cut      ? "the image file is incomplete"
                       : "OpenCV cannot read this file as an image",
         "a complete image, or a pattern `images` that excludes this file");
  }
  return true;
}

bool ImageReader::IsCutShort(std::string_view bytes) {
  const auto lacks_end = [&](std::string_view end) {
    return bytes.find(end, bytes.size() / 2) == bytes.npos;
  };
  if (bytes.starts_with("\x89PNG")) return lacks_end("IEND");
  return bytes.starts_with("\xff\xd8") && lacks_end("\xff\xd9");
}

void ImageReader::Fail(const std::string& what, std::string_view expected) const {
  throw Error(ExitCode::kBadData, ErrorLine(place(), {}, what, expected));
}

}  // namespace alidade
