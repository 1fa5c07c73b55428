// SPDX-License-Identifier: Apache-2.0
#include "alidade/diagnosis/measurement_log.h"

#include <algorithm>

namespace alidade {
namespace {

constexpr std::int64_t kMinFrames = 20;

bool IsUsed(const MeasurementReport& measurement) { return InfoOf(measurement.outcome).is_used; }

}  // namespace

std::string SensorUse::RejectionText() const {
  return "sensor '" + sensor + "': " + std::to_string(rejected) + " of " +
         std::to_string(used + rejected) + " measurements were rejected";
}

MeasurementLog::MeasurementLog(const Problem& problem) {
  for (const SensorBinding& sensor : problem.sensors) {
    uses_.push_back({.sensor = sensor.name});
    innovations_.emplace_back(sensor);
  }
}

void MeasurementLog::Add(Timestamp timestamp, const UpdateReport& report) {
  for (const MeasurementReport& measurement : report.measurements()) {
    if (measurement.sensor < 0 || measurement.sensor >= std::ssize(uses_)) continue;
    AddUse(timestamp, measurement);
  }
  if (report.stale) return;
  if (first_frame_ == kNoTimestamp) first_frame_ = timestamp;
  last_frame_ = timestamp;
  if (std::ranges::none_of(report.measurements(), IsUsed)) return;
  if (used_frames_++ == 0) {
    first_used_ = timestamp;
  } else if (timestamp - last_used_ > longest_.end - longest_.start) {
    longest_ = {last_used_, timestamp};
  }
  last_used_ = timestamp;
}

void MeasurementLog::AddUse(Timestamp timestamp, const MeasurementReport& measurement) {
  const auto sensor = static_cast<std::size_t>(measurement.sensor);
  SensorUse& use = uses_[sensor];
  if (IsUsed(measurement)) {
    ++use.used;
    use.rejected_in_a_row = 0;
  } else if (InfoOf(measurement.outcome).is_rejection) {
    ++use.rejected;
    const bool is_single = measurement.landmark < 0;  // landmarks are rejected individually
    if (is_single && use.rejected_in_a_row++ == 0) use.rejected_since = timestamp;
  }
  innovations_[sensor].Add(timestamp, measurement);
}

std::optional<MeasurementLog::Gap> MeasurementLog::longest_gap() const {
  if (used_frames_ < kMinFrames) return std::nullopt;
  Gap gap = longest_;
  if (last_frame_ - last_used_ > gap.end - gap.start) gap = {last_used_, last_frame_};
  const Timestamp gap_between = gap.start < last_used_ ? gap.end - gap.start : 0;
  const double mean = static_cast<double>(last_used_ - first_used_ - gap_between) /
                      static_cast<double>(used_frames_ - 1);
  if (static_cast<double>(gap.end - gap.start) < kLongGap * mean) return std::nullopt;
  return gap;
}

std::optional<MeasurementLog::Gap> MeasurementLog::FinalGap(std::size_t sensor) const {
  constexpr double kSmallestShare = 0.1;
  const InnovationSeries& series = innovations_[sensor];
  if (series.frames < kMinFrames) return std::nullopt;
  const double gap = static_cast<double>(last_frame_ - series.last);
  const double mean =
      static_cast<double>(series.last - series.first) / (static_cast<double>(series.frames) - 1.0);
  const double run = static_cast<double>(last_frame_ - first_frame_);
  if (gap < std::max(kLongGap * mean, kSmallestShare * run)) return std::nullopt;
  return Gap{series.last, last_frame_};
}

}  // namespace alidade
