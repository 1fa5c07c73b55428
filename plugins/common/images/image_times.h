// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "alidade/base/error.h"
#include "plugins/common/companion_files.h"

namespace alidade {

/// When images were taken: by a table `frame,t_s` that has each of them, by a table of their names,
/// at a rate, or as they come.
///
/// Errors       kBadData: an image without a time; times that do not increase; a time without an
///              image in a table by number, for an image that is gone would give those after it the
///              times of others.
class ImageTimes {
 public:
  /// By the clock, counted from the first image: a camera.
  ImageTimes() = default;
  explicit ImageTimes(double rate_hz) : rate_hz_(rate_hz) {}
  ImageTimes(const std::filesystem::path& table, const Node& key) {
    rows_ = std::make_unique<TimestampRows>(table, key.place(), key.path());
  }

  /// The table of a folder of images where one of these has it; none where none has.
  ///
  ///   FOLDER/timestamps.csv    frame,t_s      counted from 0
  ///   FOLDER/../data.csv       t_ns,name      EuRoC: mav0/cam0/data
  ///   FOLDER/../FOLDER.txt     t_s name       TUM: rgb and rgb.txt
  ///   FOLDER/../times.txt      t_s            KITTI: image_0, a row for each
  ///
  /// `by_layout`: any of them, else the first alone.
  static std::optional<ImageTimes> Beside(const std::filesystem::path& folder, bool by_layout,
                                          const Node& key) {
    std::error_code error;
    const auto is_there = [&](const std::filesystem::path& file) {
      return std::filesystem::is_regular_file(file, error);
    };
    if (is_there(folder / "timestamps.csv")) return ImageTimes(folder / "timestamps.csv", key);
    if (!by_layout) return std::nullopt;
    const std::filesystem::path whole = std::filesystem::weakly_canonical(folder, error);
    const std::filesystem::path home = whole.parent_path();
    ImageTimes times;
    if (const auto euroc = home / "data.csv"; is_there(euroc)) {
      times.ReadNamed(NumberRows(euroc, key.place(), key.path()), true);
    } else if (const auto tum = home / (whole.filename().string() + ".txt"); is_there(tum)) {
      times.ReadNamed(NumberRows(tum, key.place(), key.path(), ' '), false);
    } else if (const auto kitti = home / "times.txt"; is_there(kitti)) {
      times.ReadPlain(NumberRows(kitti, key.place(), key.path()));
    } else {
      return std::nullopt;
    }
    return times;
  }

  /// Of image `number`, from 0, of that file name; asked for in order.
  Timestamp At(std::int64_t number, const std::string& name = {}) {
    if (!table_.empty()) return InTable(number, name);
    if (rate_hz_ > 0.0) return TimestampFromSeconds(static_cast<double>(number) / rate_hz_);
    if (!rows_) return ByTheClock();
    std::int64_t frame = -1;
    Timestamp timestamp = 0;
    while (frame < number && rows_->Next(frame, timestamp)) continue;
    if (frame != number) Fail(rows_->name(), "has no time for image " + std::to_string(number));
    return timestamp;
  }
  /// After the last of all images.
  void End(std::int64_t count) {
    const std::string found = ", but there are " + std::to_string(count) + " images";
    if (std::ssize(by_number_) > count) {
      Fail(table_, "has " + std::to_string(by_number_.size()) + " times" + found);
    }
    std::int64_t frame = 0;
    Timestamp timestamp = 0;
    if (!rows_ || !rows_->Next(frame, timestamp)) return;
    Fail(rows_->name(), "has a time for image " + std::to_string(frame) + found);
  }

 private:
  void ReadNamed(NumberRows&& rows, bool in_ns) {
    table_ = rows.name();
    const char* const columns = in_ns ? "t_ns,name" : "t_s name";
    while (rows.Next()) {
      rows.ExpectColumns(2, columns);
      const Timestamp t = in_ns ? rows.Index(0, "t_ns") : rows.Time(0, "t_s");
      const std::string name = std::filesystem::path(rows.text(1)).filename().string();
      if (!by_name_.emplace(name, t).second) {
        rows.FailCell(1, "name", "is there twice", "each once");
      }
    }
    if (by_name_.empty()) rows.FailLine("no rows", "a row `" + std::string(columns) + "` an image");
  }
  void ReadPlain(NumberRows&& rows) {
    table_ = rows.name();
    while (rows.Next()) {
      rows.ExpectColumns(1, "t_s");
      by_number_.push_back(rows.Time(0, "t_s"));
    }
    if (by_number_.empty()) rows.FailLine("no rows", "a row `t_s` for each image");
  }

  Timestamp InTable(std::int64_t number, const std::string& name) {
    const bool by_name = !by_name_.empty();
    const auto found = by_name_.find(name);
    const std::string image = by_name ? name : std::to_string(number);
    if (by_name ? found == by_name_.end() : number >= std::ssize(by_number_)) {
      Fail(table_, "has no time for image " + image);
    }
    const Timestamp t = by_name ? found->second : by_number_[static_cast<std::size_t>(number)];
    if (last_ && t <= *last_) {
      Fail(table_, "has a time for image " + image + " that is not after that of the one before",
           "times that increase");
    }
    last_ = t;
    return t;
  }
  Timestamp ByTheClock() {
    const auto now = std::chrono::steady_clock::now();
    if (!first_) first_ = now;
    return std::chrono::nanoseconds(now - *first_).count();
  }
  [[noreturn]] void Fail(const std::string& table, const std::string& what,
                         const char* expected = "a time for each image") const {
    throw Error(ExitCode::kBadData, ErrorLine({table}, {}, what, expected));
  }

  double rate_hz_ = 0.0;
  std::unique_ptr<TimestampRows> rows_;
  std::string table_;  ///< file of the times below
  std::map<std::string, Timestamp> by_name_;
  std::vector<Timestamp> by_number_;
  std::optional<Timestamp> last_;  ///< given out of them
  std::optional<std::chrono::steady_clock::time_point> first_;
};

}  // namespace alidade
