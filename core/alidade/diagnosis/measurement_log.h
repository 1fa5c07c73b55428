// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "alidade/base/timestamp.h"
#include "alidade/diagnosis/innovation_series.h"
#include "alidade/estimation/estimator.h"

namespace alidade {

/// Use of the measurements of a sensor over a run.
struct SensorUse {
  std::string sensor;
  std::int64_t used = 0, rejected = 0;
  std::int64_t rejected_in_a_row = 0;       ///< rejections since the last used measurement
  Timestamp rejected_since = kNoTimestamp;  ///< time of the first of these rejections

  /// Returns `sensor 'NAME': N of M measurements were rejected`.
  std::string RejectionText() const;
};

/// Measurements of one estimator over a run: how many of each sensor were used, their innovations,
/// and the longest time without a used measurement.
class MeasurementLog {
 public:
  explicit MeasurementLog(const Problem& problem);

  /// Adds the measurements of a frame.
  void Add(Timestamp timestamp, const UpdateReport& report);

  /// Use of the measurements of each sensor.
  const std::vector<SensorUse>& uses() const { return uses_; }
  /// Innovations of each sensor.
  const std::vector<InnovationSeries>& innovations() const { return innovations_; }

  struct Gap {
    Timestamp start, end;
  };
  static constexpr double kLongGap = 30.0;
  /// Returns the longest time without a used measurement, between used measurements and up to the
  /// last frame; nullopt unless it is at least kLongGap times the mean interval between frames with
  /// a used measurement.
  std::optional<Gap> longest_gap() const;
  /// Returns the time from the last measurement of a sensor, with any outcome, to the last frame;
  /// nullopt unless it is at least kLongGap times the mean interval between the measurements of the
  /// sensor, and at least a tenth of the run.
  std::optional<Gap> FinalGap(std::size_t sensor) const;

 private:
  void AddUse(Timestamp timestamp, const MeasurementReport& measurement);

  std::vector<SensorUse> uses_;
  std::vector<InnovationSeries> innovations_;
  std::int64_t used_frames_ = 0;  ///< frames with a used measurement
  Timestamp first_used_ = kNoTimestamp, last_used_ = kNoTimestamp;
  Timestamp first_frame_ = kNoTimestamp, last_frame_ = kNoTimestamp;  ///< of all frames
  Gap longest_ = {};  ///< longest time between two frames with one
};

}  // namespace alidade
