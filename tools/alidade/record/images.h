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

/// Writer of camera images. It writes an image for each frame to a video, a folder or a window.
class ImageWriter {
 public:
  virtual ~ImageWriter() = default;
  /// Draws the image of frame `number` with points at `pixels` (u, v). The timestamps of the first
  /// two frames determine the frame rate of a video. Errors: kCannotCreate, kIo.
  virtual void Add(std::int64_t number, Timestamp timestamp,
                   const std::vector<std::array<double, 2>>& pixels) = 0;
  /// Adds an image without drawing on it. All images must have the same size.
  virtual void Add(std::int64_t number, Timestamp timestamp, const GreyImage& image) = 0;
  /// Draws the image of a frame with the marked features, and draws the estimate next to the image.
  virtual void Add(const RunView& view) = 0;
  /// Completes the output. Error: kIo.
  virtual void Close() = 0;
};

/// Arguments for the creation of an image writer.
struct ImageArguments {
  enum class Form { kVideo, kImages, kWindow } form;
  /// Path of the video, path of the folder of images, or title of the window. The parent folder
  /// must exist.
  std::filesystem::path path;
  std::string shown;  ///< path as it appears in messages
  int width, height;  ///< size of images that are drawn from points, px
};

inline constexpr const char* kImageWriterKind = "image writer";

/// Factory that an image writer plugin exports.
struct ImageWriterEntry {
  std::unique_ptr<ImageWriter> (*create)(const ImageArguments& arguments);
};
constexpr CppEntry EntryOf(const ImageWriterEntry& writer) {
  return {kImageWriterKind, "images", "", "", "", &writer};
}

/// Creates an image writer with the C++ plugin in `folder`. If `folder` is empty, the plugin that
/// was built with this library is used. The plugin is loaded at the first use, because the
/// libraries that it needs load slowly. A separate plugin opens windows. Errors: kPlugin,
/// kNotTrusted, kCannotCreate, kIo.
std::unique_ptr<ImageWriter> OpenImageWriter(const ImageArguments& arguments,
                                             const std::filesystem::path& folder = {});

}  // namespace alidade

/// Exports the image writer of this plugin: ALIDADE_IMAGE_PLUGIN(&Create)
#define ALIDADE_IMAGE_PLUGIN(create) ALIDADE_CPP_PLUGIN(alidade::ImageWriterEntry, {create})
