// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/config/config.h"

namespace alidade {

/// The calibration in the comments above the header of a table, as in
/// `# fx_px=721.5377 baseline_m=0.5371505882506209; points 55 and 144`.
///
///   written as              unit  key by which models ask
///   focal_px= or fx_px=     px    focal_px, camera.fx
///   baseline_m=             m     baseline_m, camera.baseline_m
class CsvCalibration {
 public:
  /// Notes what a comment tells, which begins in column 1 of `line`.
  void Note(std::string_view comment, const std::string& file, int line);

  /// As of Source::Calibration. Errors: kBadData where a value is no number, or is there twice.
  std::optional<Config> Get() const;

 private:
  struct Written {
    std::string key, text;
    Place place;
  };
  [[noreturn]] static void Fail(const Written& note, const std::string& what,
                                std::string_view expected);

  std::vector<Written> notes_;
};

}  // namespace alidade
