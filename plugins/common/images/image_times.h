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

/// When images were taken: by a table `frame,t_s` that has each of them, by a table of their names,
/// at a rate, or as they come. Tables are read whole when this is made.
///
/// Errors       kBadData, with file and line: an image without a time; times that do not increase;
///              a time without an image in a table by number, for an image that is gone would give
///              those after it the times of others.
class ImageTimes {
 public:
  /// By the clock, counted from the first image: a camera.
  ImageTimes() = default;
  explicit ImageTimes(double rate_hz) : rate_hz_(rate_hz) {}
  ImageTimes(const std::filesystem::path& table, const Node& key);

  /// The table of a folder of images where one of these has it; none where none has.
  ///
  ///   FOLDER/timestamps.csv    frame,t_s      counted from 0
  ///   FOLDER/../data.csv       t_ns,name      EuRoC: mav0/cam0/data
  ///   FOLDER/../FOLDER.txt     t_s name       TUM: rgb and rgb.txt
  ///   FOLDER/../times.txt      t_s            KITTI: image_0, a row for each
  ///
  /// `by_layout`: any of them, else the first alone.
  static std::optional<ImageTimes> Beside(const std::filesystem::path& folder, bool by_layout,
                                          const Node& key);

  /// Whether each of the images of a folder from `first` on, `most` of them or all if that is 0,
  /// has a time, after that of the one before. Of a video that is seen as they come.
  void Check(const ImageReader& images, std::int64_t first, std::int64_t most) const;
  /// Of image `number`, from 0, of that file name.
  Timestamp At(std::int64_t number, const std::string& name);
  /// After the last of all images.
  void End(std::int64_t count) const;

 private:
  struct Row {
    Timestamp t;
    int line;
  };

  void ReadNamed(NumberRows&& rows, bool in_ns);
  void ReadPlain(NumberRows&& rows);

  const Row& RowOf(std::int64_t number, const std::string& name) const;
  Timestamp ByTheClock();
  [[noreturn]] void Fail(int line, const std::string& what,
                         const char* expected = "a time for each image") const;

  double rate_hz_ = 0.0;
  std::string table_;  ///< file of the times below; empty: there is none
  std::map<std::string, Row> by_name_;
  std::map<std::int64_t, Row> by_number_;
  std::optional<std::chrono::steady_clock::time_point> first_;
};

}  // namespace alidade
