// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "alidade/base/timestamp.h"
#include "alidade/experiment/source.h"

namespace alidade {

/// What became of a measurement: its colour.
enum class Mark {
  kAccepted,
  kRejected,  ///< by the gate, or by outlier rejection
  kNew,       ///< consumed to initialise, or waiting for that
  kLost,      ///< it was measured in the frame before, and is not any more
  kUnused,    ///< by no sensor, or of no use to one
};
inline constexpr int kMarks = static_cast<int>(Mark::kUnused) + 1;

/// Mean and covariance of a point in a plane.
struct PlaneGaussian {
  double x, y;
  double xx, xy, yy;
};

/// A feature in the image, px; the centre of the upper left pixel is (0, 0).
struct ViewFeature {
  Mark mark;
  std::array<double, 2> at;                      ///< measured; of a lost one, where it was last
  std::optional<PlaneGaussian> predicted;        ///< h and S
  std::vector<std::array<double, 2>> tail = {};  ///< where it was in the frames before
};

/// A measurement that is no place in the image.
struct ViewInnovation {
  std::string name;  ///< of the sensor
  Mark mark;
  double measured;
  double sigmas;  ///< r / sqrt(S) of its first element; NaN: not reached
};

/// One number of the state; its truth is NaN where it is not known.
struct ViewElement {
  std::string name, unit;
  double value, sigma, truth;
};

/// A trajectory and its landmarks from above, m.
struct ViewMap {
  std::string right, up;  ///< names of the axes
  std::vector<std::array<double, 2>> path, true_path;
  PlaneGaussian position;
  std::array<double, 2> heading;  ///< the optical axis
  std::vector<PlaneGaussian> landmarks;
  std::array<double, 4> bounds;  ///< what is shown: least and largest right, up
};

/// One element over time.
struct ViewSeries {
  std::string name, unit;
  std::vector<double> t_s, value, sigma, truth;
};

/// One frame of a run, for people to see: its image, and what one estimator made of it.
struct RunView {
  std::int64_t number = 0;
  Timestamp timestamp = 0;
  std::string title, estimator;
  MeasuredImage image;
  Mark outline = Mark::kLost;  ///< of the target in the image, if it has one
  std::vector<ViewFeature> features;
  std::array<int, kMarks> counts{};  ///< measurements by what became of them
  std::vector<ViewInnovation> innovations;
  std::vector<ViewElement> elements;
  int landmarks = -1;  ///< in the state; -1: the estimator has none at all
  std::optional<ViewMap> map;
  std::optional<ViewSeries> series;  ///< where there is no map
};

}  // namespace alidade
