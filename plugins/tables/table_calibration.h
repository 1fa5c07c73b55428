// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/config/config.h"

namespace alidade {

/// Calibration in the comments above the header of a table, such as
/// `# fx_px=721.5377 baseline_m=0.5371505882506209; points 55 and 144`.
///
///   in the comment          unit  key that models use
///   focal_px= or fx_px=     px    focal_px, camera.fx
///   baseline_m=             m     baseline_m, camera.baseline_m
class TableCalibration {
 public:
  /// Records the numbers in a comment that begins in column 1 of `line`.
  void Record(std::string_view comment, const std::string& file, int line);

  /// Returns the calibration in the form of Source::Calibration. Errors: kBadData if a value is not
  /// a number or occurs twice.
  std::optional<Config> Get() const;

 private:
  struct Entry {
    std::string key, text;
    Place place;
  };
  [[noreturn]] static void Fail(const Entry& entry, const std::string& problem,
                                std::string_view expected);

  std::vector<Entry> entries_;
};

}  // namespace alidade
