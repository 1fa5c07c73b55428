// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "alidade/base/timestamp.h"
#include "alidade/config/config.h"
#include "alidade/io/number_rows.h"
#include "plugins/common/images/image_reader.h"

namespace alidade {

/// Provides the times of images, which are read from a table `frame,t_s`, from a table of file
/// names, or from the clock, or follow from a constant rate. A table is read completely before the
/// first image.
///
/// Errors       kBadData with file and line, if an image has no time, if times do not increase, or
///              if a table of numbered images has a time without an image. The last case indicates
///              a missing image, after which all images would have wrong times.
class ImageTimes {
 public:
  /// Creates the times of a live camera. The clock provides these times, and the first image has
  /// the time 0.
  ImageTimes() = default;
  explicit ImageTimes(double rate_hz) : rate_hz_(rate_hz) {}
  ImageTimes(const std::filesystem::path& table, const Node& key);

  /// Returns the times of the images in `folder`, read from the first of these tables that exists.
  /// Returns nullopt if there is no such table:
  ///
  ///   FOLDER/timestamps.csv    frame,t_s      frames counted from 0
  ///   FOLDER/../data.csv       t_ns,name      EuRoC: mav0/cam0/data
  ///   FOLDER/../FOLDER.txt     t_s name       TUM: rgb and rgb.txt
  ///   FOLDER/../times.txt      t_s            KITTI: image_0, a row for each image
  ///
  /// If `by_layout` is false, only timestamps.csv is considered.
  static std::optional<ImageTimes> FindNextTo(const std::filesystem::path& folder, bool by_layout,
                                              const Node& key);

  /// Checks that each image of a folder, from number `first` on, has a time, and that these times
  /// increase. Checks `max_count` images, or all if `max_count` is 0. The times of a video are
  /// checked later, when its images are read.
  void Check(const ImageReader& images, std::int64_t first, std::int64_t max_count) const;
  /// Returns the time of image `number`, counted from 0, with the file name `name`.
  Timestamp At(std::int64_t number, const std::string& name);
  /// Checks that the table has no time for an image that does not exist. `count` is the number of
  /// images, which is known after the last image.
  void End(std::int64_t count) const;

 private:
  struct Row {
    Timestamp t;
    int line;
  };

  void ReadNamed(NumberRows&& rows, bool in_ns);
  void ReadPlain(NumberRows&& rows);

  const Row& RowOf(std::int64_t number, const std::string& name) const;
  Timestamp ElapsedTime();
  [[noreturn]] void Fail(int line, const std::string& what,
                         const char* expected = "a time for each image") const;

  double rate_hz_ = 0.0;
  std::string table_;  ///< path of the table; "" if there is no table
  std::map<std::string, Row> by_name_;
  std::map<std::int64_t, Row> by_number_;
  std::optional<std::chrono::steady_clock::time_point> first_;
};

}  // namespace alidade
