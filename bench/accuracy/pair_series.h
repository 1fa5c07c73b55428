// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

namespace alidade::bench {

/// Row of a series: measurements of two image points that are at the same depth.
struct PairRow {
  double t_s;
  double disparity_px;
  double scale;    ///< distance of the points in the left image / distance in the first row
  double depth_m;  ///< reference depth
};

/// Series of an approach to a target. Stereo measures in the first `seen_count` rows. The other
/// rows are the blind half.
struct PairSeries {
  std::string name;
  double bf_px_m = 0.0;  ///< focal length times baseline, from the header of the series
  std::vector<PairRow> rows;
  std::size_t seen_count = 0;
};

/// Returns the slope c [px] of the line d = c s, by least squares over the rows in which stereo
/// measures:
///
///   c = sum d s / sum s^2
///
/// Without noise c is f B / Z0, with the depth Z0 of the first row.
inline double LineSlope(const PairSeries& series) {
  double ds = 0.0, ss = 0.0;
  for (std::size_t i = 0; i < series.seen_count; ++i) {
    ds += series.rows[i].disparity_px * series.rows[i].scale;
    ss += series.rows[i].scale * series.rows[i].scale;
  }
  return ds / ss;
}

/// Returns the RMSE [m] of the depth Z = k / s in the blind half, with k in m.
inline double BlindRmse(const PairSeries& series, double k_m) {
  double sum = 0.0;
  for (std::size_t i = series.seen_count; i < series.rows.size(); ++i) {
    const double error = k_m / series.rows[i].scale - series.rows[i].depth_m;
    sum += error * error;
  }
  return std::sqrt(sum / static_cast<double>(series.rows.size() - series.seen_count));
}

/// Returns the RMSE [m], in the blind half, of the depth that the line d = c s predicts: Z = f B /
/// (c s).
inline double LineRmse(const PairSeries& series) {
  return BlindRmse(series, series.bf_px_m / LineSlope(series));
}

/// Returns the RMSE [m], in the blind half, of the depth Z = Za sa / s. Za is the reference depth
/// and sa is the scale of the last row in which stereo measures. This is the error that the drift
/// of the scale adds to an exact depth.
inline double AnchoredRmse(const PairSeries& series) {
  const PairRow& last = series.rows[series.seen_count - 1];
  return BlindRmse(series, last.depth_m * last.scale);
}

/// Returns the RMSE [m], in the blind half, of the depth Z = k / s for the best k. This k follows
/// from the reference depths of the blind half. No constant lambda has a smaller error.
inline double BestConstantRmse(const PairSeries& series) {
  double z_over_s = 0.0, one_over_ss = 0.0;
  for (std::size_t i = series.seen_count; i < series.rows.size(); ++i) {
    const PairRow& row = series.rows[i];
    z_over_s += row.depth_m / row.scale;
    one_over_ss += 1.0 / (row.scale * row.scale);
  }
  return BlindRmse(series, z_over_s / one_over_ss);
}

/// Returns the mean square [-] of the growth of log(s Z) over `lag` rows. s Z is the constant Z0 if
/// both points have the same depth and exact tracks. For a random walk the result is proportional
/// to lag; for a drift at a constant rate it is proportional to lag^2.
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

/// Returns the variance of the white noise of y = value(row) over the rows in which stereo
/// measures. The variance follows from second differences, which a ramp does not change: mean
/// (y[i-1] - 2 y[i] + y[i+1])^2 / 6.
template <class Value>
double WhiteVariance(const PairSeries& series, const Value& value) {
  double sum = 0.0;
  for (std::size_t i = 1; i + 1 < series.seen_count; ++i) {
    const double second_difference =
        value(series.rows[i - 1]) - 2.0 * value(series.rows[i]) + value(series.rows[i + 1]);
    sum += second_difference * second_difference;
  }
  return sum / 6.0 / static_cast<double>(series.seen_count - 2);
}

}  // namespace alidade::bench
