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

/// Result of a measurement in the filter. The result determines the colour of the measurement.
enum class Mark {
  kAccepted,
  kRejected,  ///< rejected by the gate or by outlier rejection
  kNew,       ///< used for an initialisation, or stored for a later initialisation
  kLost,      ///< measured in the previous frame, but not in this frame
  kUnused,    ///< not used by a sensor
};
inline constexpr int kMarks = static_cast<int>(Mark::kUnused) + 1;

/// Mean and covariance of a point in a plane.
struct PlaneGaussian {
  double x, y;
  double xx, xy, yy;
};

/// Feature in the image, px. The centre of the upper left pixel is (0, 0).
struct ViewFeature {
  Mark mark;
  std::array<double, 2> pixel;                    ///< pixel of the last measurement
  std::optional<PlaneGaussian> predicted;         ///< predicted pixel h with covariance S
  std::vector<std::array<double, 2>> trail = {};  ///< pixels in earlier frames
};

/// Measurement that is not a position in the image.
struct ViewInnovation {
  std::string name;  ///< name of the sensor
  Mark mark;
  double measured;
  double sigmas;  ///< r / sqrt(S) of the first element; NaN: not computed
};

/// Element of the state. The truth is NaN if it is unknown.
struct ViewElement {
  std::string name, unit;
  double value, sigma, truth;
};

/// Trajectory and landmarks, viewed from above, m.
struct ViewMap {
  std::string right, up;  ///< names of the axes
  std::vector<std::array<double, 2>> path, true_path;
  PlaneGaussian position;
  std::array<double, 2> heading;  ///< direction of the optical axis
  std::vector<PlaneGaussian> landmarks;
  std::array<double, 4> bounds;  ///< visible range: min and max of right, min and max of up
};

/// Element of the state over time.
struct ViewSeries {
  std::string name, unit;
  std::vector<double> t_s, value, sigma, truth;
};

/// View of one frame of a run: the image of the frame, and the estimate of one estimator.
struct RunView {
  std::int64_t number = 0;
  Timestamp timestamp = 0;
  std::string title, estimator;
  MeasuredImage image;
  Mark outline = Mark::kLost;  ///< mark of the target in the image, if there is a target
  std::vector<ViewFeature> features;
  std::array<int, kMarks> counts{};  ///< number of measurements with each mark
  std::vector<ViewInnovation> innovations;
  std::vector<ViewElement> elements;
  int landmarks = -1;  ///< number of landmarks in the state; -1: the estimator has no landmarks
  std::optional<ViewMap> map;
  std::optional<ViewSeries> series;  ///< series that is shown if there is no map
};

}  // namespace alidade
