// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <string>

#include "alidade/experiment/source.h"
#include "bench/accuracy/pair_series.h"

namespace alidade::bench {

/// Reads all rows of a source. The source must have the streams `disparity` and `inverse_scale`,
/// the depth as its first true value, and f B in its calibration. `seen_count` counts the rows up
/// to the last disparity.
inline PairSeries ReadPairSeries(Source& source, const std::string& name) {
  PairSeries series{name, 0.0, {}, 0};
  const Config calibration = source.Calibration().value();
  const Node camera = calibration.root().At("calibration");
  series.bf_px_m = camera.At("focal_px").Number() * camera.At("baseline_m").Number();
  SourceFrame frame;
  while (source.Next(frame)) {
    PairRow row{Seconds(frame.timestamp), NAN, NAN, frame.truth.at(0).at(0)};
    for (const Measurement& m : frame.measurements) {
      const double value = m.values.at(0);
      if (source.streams().at(m.stream).name == "disparity") {
        row.disparity_px = value;
      } else {
        row.scale = 1.0 / value;
      }
    }
    series.rows.push_back(row);
    if (std::isfinite(row.disparity_px)) series.seen_count = series.rows.size();
  }
  return series;
}

}  // namespace alidade::bench
