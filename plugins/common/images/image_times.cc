// SPDX-License-Identifier: Apache-2.0
#include "plugins/common/images/image_times.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "alidade/base/error.h"
#include "plugins/common/companion_files.h"

namespace alidade {

ImageTimes::ImageTimes(const std::filesystem::path& table, const Node& key) {
  TimestampRows rows(table, key.place(), key.path());
  table_ = rows.name();
  std::int64_t number = 0;
  for (Timestamp t = 0; rows.Next(number, t);) {
    by_number_.emplace_hint(by_number_.end(), number, Row{t, rows.line()});
  }
}

std::optional<ImageTimes> ImageTimes::FindNextTo(const std::filesystem::path& folder,
                                                 bool by_layout, const Node& key) {
  std::error_code error;
  const auto exists = [&](const std::filesystem::path& file) {
    return std::filesystem::is_regular_file(file, error);
  };
  if (exists(folder / "timestamps.csv")) return ImageTimes(folder / "timestamps.csv", key);
  if (!by_layout) return std::nullopt;
  const std::filesystem::path canonical_folder = std::filesystem::weakly_canonical(folder, error);
  const std::filesystem::path parent = canonical_folder.parent_path();
  ImageTimes times;
  if (const auto euroc = parent / "data.csv"; exists(euroc)) {
    times.ReadNamed(NumberRows(euroc, key.place(), key.path()), true);
  } else if (const auto tum = parent / (canonical_folder.filename().string() + ".txt");
             exists(tum)) {
    times.ReadNamed(NumberRows(tum, key.place(), key.path(), ' '), false);
  } else if (const auto kitti = parent / "times.txt"; exists(kitti)) {
    times.ReadPlain(NumberRows(kitti, key.place(), key.path()));
  } else {
    return std::nullopt;
  }
  return times;
}

void ImageTimes::Check(const ImageReader& images, std::int64_t first,
                       std::int64_t max_count) const {
  if (table_.empty() || images.is_video()) return;
  const std::int64_t end =
      max_count > 0 ? std::min(images.size(), first + max_count) : images.size();
  for (std::int64_t k = first; k < end; ++k) {
    const Row& row = RowOf(k, images.name(k));
    if (k == first || by_name_.empty()) continue;  // a numbered table was checked on reading
    const Row& previous = RowOf(k - 1, images.name(k - 1));
    if (row.t > previous.t) continue;
    Fail(row.line,
         "the time of image " + images.name(k) + " is not later than the time of image " +
             images.name(k - 1) + " in line " + std::to_string(previous.line),
         "increasing times, in the order of the names of the images");
  }
  End(images.size());
}

Timestamp ImageTimes::At(std::int64_t number, const std::string& name) {
  if (!table_.empty()) return RowOf(number, name).t;
  if (rate_hz_ > 0.0) return TimestampFromSeconds(static_cast<double>(number) / rate_hz_);
  return ElapsedTime();
}

void ImageTimes::End(std::int64_t count) const {
  const auto surplus = by_number_.lower_bound(count);
  if (surplus == by_number_.end()) return;
  Fail(surplus->second.line, "there is a time for image " + std::to_string(surplus->first) +
                                 ", but the source has " + std::to_string(count) +
                                 " images, counted from 0");
}

void ImageTimes::ReadNamed(NumberRows&& rows, bool in_ns) {
  table_ = rows.name();
  const char* const columns = in_ns ? "t_ns,name" : "t_s name";
  while (rows.Next()) {
    rows.ExpectColumns(2, columns);
    const Timestamp t = in_ns ? rows.Index(0, "t_ns") : rows.Time(0, "t_s");
    const std::string name = std::filesystem::path(rows.text(1)).filename().string();
    if (!by_name_.emplace(name, Row{t, rows.line()}).second) {
      rows.FailCell(1, "name", "occurs twice", "each image once");
    }
  }
  if (by_name_.empty())
    rows.FailLine("the file contains no rows",
                  "a row `" + std::string(columns) + "` for each image");
}

void ImageTimes::ReadPlain(NumberRows&& rows) {
  table_ = rows.name();
  while (rows.Next()) {
    rows.ExpectColumns(1, "t_s");
    const Timestamp t = rows.Time(0, "t_s");
    if (!by_number_.empty() && t <= by_number_.rbegin()->second.t) {
      rows.FailCell(0, "t_s",
                    "is not later than in line " + std::to_string(by_number_.rbegin()->second.line),
                    "increasing times");
    }
    by_number_.emplace_hint(by_number_.end(), std::ssize(by_number_), Row{t, rows.line()});
  }
  if (by_number_.empty()) rows.FailLine("the file contains no rows", "a row `t_s` for each image");
}

const ImageTimes::Row& ImageTimes::RowOf(std::int64_t number, const std::string& name) const {
  if (!by_name_.empty()) {
    const auto found = by_name_.find(name);
    if (found == by_name_.end()) Fail(0, "there is no time for image " + name);
    return found->second;
  }
  const auto found = by_number_.lower_bound(number);
  if (found != by_number_.end() && found->first == number) return found->second;
  const auto nearest = found == by_number_.end() ? std::prev(found) : found;
  Fail(nearest->second.line, "there is no time for image " + std::to_string(number));
}

Timestamp ImageTimes::ElapsedTime() {
  const auto now = std::chrono::steady_clock::now();
  if (!first_) first_ = now;
  return std::chrono::nanoseconds(now - *first_).count();
}

void ImageTimes::Fail(int line, const std::string& what, const char* expected) const {
  throw Error(ExitCode::kBadData, ErrorLine({table_, line}, {}, what, expected));
}

}  // namespace alidade
