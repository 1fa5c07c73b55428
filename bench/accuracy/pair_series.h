// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

namespace alidade::bench {

/// One row of a series: two image points at one depth.
struct PairRow {
  double t_s;
  double disparity_px;
  double scale;    ///< their distance in the left image relative to the first row
  double depth_m;  ///< of the reference
};

/// An approach, of whose rows stereo sees the first `seen`; the others are the blind half.
struct PairSeries {
  std::string name;
  double bf_px_m = 0.0;  ///< focal length times baseline, of the header of this series
  std::vector<PairRow> rows;
  std::size_t seen = 0;
};

/// Slope c [px] of the line d = c s, least squares over the rows that stereo sees:
///
///   c = sum d s / sum s^2
///
/// Without noise c = f B / Z0, Z0 the depth of the first row.
inline double LineSlope(const PairSeries& series) {
  double ds = 0.0, ss = 0.0;
  for (std::size_t i = 0; i < series.seen; ++i) {
    ds += series.rows[i].disparity_px * series.rows[i].scale;
    ss += series.rows[i].scale * series.rows[i].scale;
  }
  return ds / ss;
}

/// RMSE [m] in the blind half of the depth Z = k / s, k in m.
inline double BlindRmse(const PairSeries& series, double k_m) {
  double sum = 0.0;
  for (std::size_t i = series.seen; i < series.rows.size(); ++i) {
    const double error = k_m / series.rows[i].scale - series.rows[i].depth_m;
    sum += error * error;
  }
  return std::sqrt(sum / static_cast<double>(series.rows.size() - series.seen));
}

/// RMSE [m] in the blind half of the depth that the line d = c s predicts, Z = f B / (c s).
inline double LineRmse(const PairSeries& series) {
  return BlindRmse(series, series.bf_px_m / LineSlope(series));
}

/// RMSE [m] in the blind half of Z = Za sa / s, Za and sa the reference depth and the scale of the
/// last row that stereo sees: what the drift of the scale leaves of depth that was known exactly.
inline double AnchoredRmse(const PairSeries& series) {
  const PairRow& last = series.rows[series.seen - 1];
  return BlindRmse(series, last.depth_m * last.scale);
}

/// RMSE [m] in the blind half of Z = k / s with the k that makes it least, taken from the reference
/// there: no value of lambda that stays does better.
inline double BestConstantRmse(const PairSeries& series) {
  double z_over_s = 0.0, one_over_ss = 0.0;
  for (std::size_t i = series.seen; i < series.rows.size(); ++i) {
    const PairRow& row = series.rows[i];
    z_over_s += row.depth_m / row.scale;
    one_over_ss += 1.0 / (row.scale * row.scale);
  }
  return BlindRmse(series, z_over_s / one_over_ss);
}

/// Mean square [-] of the growth of log(s Z) over `lag` rows. s Z is Z0, a constant, where points
/// are at one depth and tracked exactly. A random walk has lag times the value of lag 1; a drift at
/// a constant rate lag^2 times.
inline double DriftVariance(const PairSeries& series, std::size_t lag) {
  const std::vector<PairRow>& rows = series.rows;
  double sum = 0.0;
  for (std::size_t i = lag; i < rows.size(); ++i) {
    const double growth = std::log(rows[i].scale * rows[i].depth_m) -
                          std::log(rows[i - lag].scale * rows[i - lag].depth_m);
    sum += growth * growth;
  }
  return sum / static_cast<double>(rows.size() - lag);
}

/// Variance of the white noise of value(row), from its second differences over the rows that stereo
/// sees, which a ramp does not change: mean (y[i-1] - 2 y[i] + y[i+1])^2 / 6.
template <class Value>
double WhiteVariance(const PairSeries& series, const Value& value) {
  double sum = 0.0;
  for (std::size_t i = 1; i + 1 < series.seen; ++i) {
    const double bend =
        value(series.rows[i - 1]) - 2.0 * value(series.rows[i]) + value(series.rows[i + 1]);
    sum += bend * bend;
  }
  return sum / 6.0 / static_cast<double>(series.seen - 2);
}

}  // namespace alidade::bench
