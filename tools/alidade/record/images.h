// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "alidade/experiment/source.h"
#include "alidade/plugin/cpp_plugin.h"
#include "alidade/record/run_view.h"

namespace alidade {

/// What a camera sees, frame by frame: a video or a folder of images.
class ImageWriter {
 public:
  virtual ~ImageWriter() = default;
  /// Adds the image of frame `number`, of whose points `pixels` are the centres (u, v); the
  /// timestamps of the first two frames give the rate of a video. Errors: kCannotCreate, kIo.
  virtual void Add(std::int64_t number, Timestamp timestamp,
                   const std::vector<std::array<double, 2>>& pixels) = 0;
  /// Adds an image as it is; all are of one size.
  virtual void Add(std::int64_t number, Timestamp timestamp, const GreyImage& image) = 0;
  /// Adds the image of a frame with what became of it, next to it the estimate.
  virtual void Add(const RunView& view) = 0;
  /// Completes what was written. Error: kIo.
  virtual void Close() = 0;
};

/// What an image writer is made from.
struct ImageArguments {
  enum class Form { kVideo, kImages, kWindow } form;
  /// Of the video, or of the folder of images, whose folder is there; or the title of the window.
  std::filesystem::path path;
  std::string shown;  ///< the path in messages
  int width, height;  ///< px, of images that are drawn from points
};

inline constexpr const char* kImageWriterKind = "image writer";

/// The factory of an image writer.
struct ImageWriterEntry {
  std::unique_ptr<ImageWriter> (*create)(const ImageArguments& arguments);
};
constexpr CppEntry EntryOf(const ImageWriterEntry& writer) {
  return {kImageWriterKind, "images", "", "", "", &writer};
}

/// Makes the image writer of the C++ plugin in `folder`; of the one that was built with
/// this library where "". It is loaded when it is first asked for, because its libraries are slow
/// to load. A window is of a plugin of its own. Errors: kPlugin, kNotTrusted, kCannotCreate, kIo.
std::unique_ptr<ImageWriter> OpenImageWriter(const ImageArguments& arguments,
                                             const std::filesystem::path& folder = {});

}  // namespace alidade

/// Exports the image writer of this plugin: ALIDADE_IMAGE_PLUGIN(&Create)
#define ALIDADE_IMAGE_PLUGIN(create) ALIDADE_CPP_PLUGIN(alidade::ImageWriterEntry, {create})
