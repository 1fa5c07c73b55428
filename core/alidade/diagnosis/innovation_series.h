// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "alidade/base/timestamp.h"
#include "alidade/estimation/estimator.h"
#include "alidade/estimation/problem.h"

namespace alidade {

/// Innovations of one sensor over a run, in the order of the measurements: those that were accepted
/// and those that the gate rejected. Row i of each array belongs to measurement i. Only the first
/// kMaxSize measurements are stored, to limit memory. m: tangent size of the measurement, a: its
/// ambient size.
struct InnovationSeries {
  static constexpr std::size_t kMaxSize = 20'000;

  std::string sensor;
  std::vector<std::string> units;  ///< unit of each element of z, a; "" if it has none
  int dof = 0;                     ///< m
  int ambient = 0;                 ///< a
  /// Index of the element of z that corresponds to each element of r, m. -1 for the elements of a
  /// rotation or a direction, which do not correspond to single elements of z.
  std::vector<int> z_index;
  std::vector<char> is_angle;       ///< whether an element of r is an angle in rad, m
  bool has_robust_loss = false;     ///< a robust loss reduces the weight of outliers
  bool has_landmark_prior = false;  ///< its landmarks start from a prior of their distance

  std::vector<Timestamp> timestamps;
  std::vector<std::int64_t> landmarks;  ///< -1: the sensor measures no landmark
  std::vector<char> accepted;
  std::vector<double> nis;         ///< r' S^-1 r
  std::vector<double> innovation;  ///< r, n x m, row-major
  std::vector<double> sigma;       ///< square roots of the diagonal of S, n x m
  std::vector<double> z, h;        ///< measurement and its prediction, n x a

  std::int64_t total = 0;          ///< measurements of the sensor, with every outcome
  std::int64_t out_of_domain = 0;  ///< those for which the sensor model is not defined
  std::int64_t frames = 0;         ///< changes of the timestamp, including the first timestamp
  Timestamp first = kNoTimestamp, last = kNoTimestamp;

  InnovationSeries() = default;
  explicit InnovationSeries(const SensorBinding& binding);
  /// Returns whether measurements with this outcome are stored.
  static bool Stores(Outcome outcome) {
    return outcome == Outcome::kAccepted || outcome == Outcome::kGated;
  }
  /// Counts a measurement with any outcome. Stores it if it was accepted or gated and has a finite
  /// NIS, unless the series is full.
  void Add(Timestamp timestamp, const MeasurementReport& measurement);

  std::size_t size() const { return timestamps.size(); }
  /// Returns the number of different timestamps of accepted measurements.
  std::int64_t accepted_frames() const;
};

}  // namespace alidade
