// SPDX-License-Identifier: Apache-2.0
#include "table_calibration.h"

#include <algorithm>

#include "alidade/base/error.h"
#include "alidade/io/text_cell.h"

namespace alidade {

void TableCalibration::Record(std::string_view comment, const std::string& file, int line) {
  constexpr std::string_view kSeparators = " \t,;()";
  for (std::size_t offset = 0; offset < comment.size();) {
    const std::size_t end = std::min(comment.find_first_of(kSeparators, offset), comment.size());
    const std::string_view word = comment.substr(offset, end - offset);
    const std::size_t equals = std::min(word.find('='), word.size());
    const std::string_view name = word.substr(0, equals);
    if (equals < word.size() && (name == "focal_px" || name == "fx_px" || name == "baseline_m")) {
      entries_.push_back({std::string(name == "fx_px" ? "focal_px" : name),
                          std::string(word.substr(equals + 1)),
                          {file, line, static_cast<int>(offset + equals) + 2}});
    }
    offset = end + 1;
  }
}

std::optional<Config> TableCalibration::Get() const {
  if (entries_.empty()) return std::nullopt;
  Config config = Config::FromText("calibration: {}", "the comments of a table");
  for (const Entry& entry : entries_) {
    double value = 0.0;
    const char* const problem = cell::ParseNumber(entry.text, value);
    if (problem != nullptr) {
      Fail(entry, '\'' + cell::PrintableStart(entry.text) + "' " + problem, "a finite number");
    }
    const auto first = std::ranges::find(entries_, entry.key, &Entry::key);
    if (&*first != &entry) {
      Fail(entry,
           "there is a second value; the first value is in line " +
               std::to_string(first->place.line),
           "one value");
    }
    const std::string origin = ToString(entry.place);
    config.Set("calibration." + entry.key, entry.text, origin);
    const std::string camera = entry.key == "focal_px" ? "fx" : entry.key;
    config.Set("calibration.camera." + camera, entry.text, origin);
  }
  return config;
}

void TableCalibration::Fail(const Entry& entry, const std::string& problem,
                            std::string_view expected) {
  throw Error(ExitCode::kBadData, ErrorLine(entry.place, entry.key, problem, expected));
}

}  // namespace alidade
