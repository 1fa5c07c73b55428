// SPDX-License-Identifier: Apache-2.0
#include "csv_calibration.h"

#include <algorithm>

#include "alidade/base/error.h"
#include "alidade/io/text_cell.h"

namespace alidade {

void CsvCalibration::Note(std::string_view comment, const std::string& file, int line) {
  constexpr std::string_view kBetween = " \t,;()";
  for (std::size_t at = 0; at < comment.size();) {
    const std::size_t end = std::min(comment.find_first_of(kBetween, at), comment.size());
    const std::string_view word = comment.substr(at, end - at);
    const std::size_t equals = std::min(word.find('='), word.size());
    const std::string_view name = word.substr(0, equals);
    if (equals < word.size() && (name == "focal_px" || name == "fx_px" || name == "baseline_m")) {
      notes_.push_back({std::string(name == "fx_px" ? "focal_px" : name),
                        std::string(word.substr(equals + 1)),
                        {file, line, static_cast<int>(at + equals) + 2}});
    }
    at = end + 1;
  }
}

std::optional<Config> CsvCalibration::Get() const {
  if (notes_.empty()) return std::nullopt;
  Config config = Config::FromText("calibration: {}", "the comments of a table");
  for (const Written& note : notes_) {
    double value = 0.0;
    const char* const wrong = cell::ParseNumber(note.text, value);
    if (wrong != nullptr) {
      Fail(note, '\'' + cell::PrintableStart(note.text) + "' " + wrong, "a finite number");
    }
    const auto first = std::ranges::find(notes_, note.key, &Written::key);
    if (&*first != &note) {
      Fail(note, "is there twice, first in line " + std::to_string(first->place.line), "one");
    }
    const std::string origin = ToString(note.place);
    config.Set("calibration." + note.key, note.text, origin);
    const std::string camera = note.key == "focal_px" ? "fx" : note.key;
    config.Set("calibration.camera." + camera, note.text, origin);
  }
  return config;
}

void CsvCalibration::Fail(const Written& note, const std::string& what, std::string_view expected) {
  throw Error(ExitCode::kBadData, ErrorLine(note.place, note.key, what, expected));
}

}  // namespace alidade
