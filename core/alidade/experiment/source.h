// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "alidade/base/timestamp.h"
#include "alidade/config/config.h"
#include "alidade/estimation/frame.h"
#include "alidade/model/params.h"

namespace alidade {

/// True values at one timestamp, one vector for each entry of Source::truths(), of its size. An
/// empty vector, or one missing at the end, is an unknown value.
using Truth = std::vector<std::vector<double>>;

/// Frame of a source, with the truth for comparison.
struct SourceFrame : Frame {
  Truth truth = {};
};

/// Grey image with 8 bits per pixel, row by row from the top.
struct GreyImage {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;
};

/// Image in which a source measured; for a stereo pair, that of the left camera.
struct MeasuredImage {
  GreyImage grey;
  /// Corners (u, v), px, of the measured target; empty if there is no target, or if it is lost.
  std::vector<std::array<double, 2>> outline = {};
};

/// Expected measurement of size m, with its covariance.
struct ExpectedMeasurement {
  std::vector<double> z;  ///< h; empty if it cannot be predicted
  std::vector<double> s;  ///< S = H P H' + R, m x m
};

/// Predictor of measurements for a source that searches near the expected values: active search
/// [Davison2007].
class Guide {
 public:
  virtual ~Guide() = default;
  /// Predicts the measurement of each landmark at `timestamp`; `stream` is an index into
  /// Source::streams(). Does not change the filter.
  virtual std::vector<ExpectedMeasurement> Expect(
      int stream, Timestamp timestamp, const std::vector<std::int64_t>& landmarks) const = 0;
};

/// Source of measurements, such as a simulator, a file or a pipe. A C++ plugin.
class Source {
 public:
  virtual ~Source() = default;
  virtual const std::vector<StreamInfo>& streams() const = 0;
  /// Returns the true values that the source provides, named like their blocks.
  virtual const std::vector<StreamInfo>& truths() const = 0;
  /// Reads the next frame; returns false at the end. The streams of its measurements are indices
  /// into streams(), and its values have the sizes of streams() and truths(). Any other frame ends
  /// the run as an internal error. Errors: kBadData, kIo.
  virtual bool Next(SourceFrame& frame) = 0;
  /// Returns the name of the filter that guides this source, from its key `guide`; "": none.
  virtual std::string guide_name() const { return {}; }
  /// Sets the requested guide for the following frames; null removes it. Without a guide, as in
  /// `alidade simulate`, the source measures unguided.
  virtual void SetGuide(const Guide* /*guide*/) {}
  /// Returns the true position of a landmark in the world, m, if the source knows it.
  virtual std::optional<std::array<double, 3>> TrueLandmark(std::int64_t /*id*/) const {
    return std::nullopt;
  }
  /// Returns the number of simulated cameras that can draw images: 0, 1, or 2 for a stereo pair.
  virtual int views() const { return 0; }
  /// Draws the image of camera `view` at the last frame; 0 is the left camera of a pair.
  virtual GreyImage Draw(int /*view*/) { return {}; }
  /// Returns whether the source measures in images; LastImage() returns them.
  virtual bool measures_images() const { return false; }
  /// Returns the image in which the last frame was measured.
  virtual MeasuredImage LastImage() const { return {}; }
  /// Returns the calibration of the camera that recorded the data, if the data have one. It is a
  /// config with one map `calibration`, whose keys are those that models read:
  /// `calibration: {camera: {fx: 721.5, baseline_m: 0.54}}`. Errors: kBadData, kInputMissing.
  virtual std::optional<Config> Calibration() const { return std::nullopt; }
  /// Returns the total number of frames, or -1 if it is unknown. For progress only.
  virtual std::int64_t size() const { return -1; }
  /// Returns the place of the last frame in its file, for messages; empty without a file.
  virtual Place place() const { return {}; }
};

class PluginHost;  // in alidade/plugin/plugin_host.h

/// Arguments of the factory of a source.
struct SourceArguments {
  Node entry;      ///< the config's `source` map
  Params& params;  ///< the same map, read by declaration (numbers, flags, choices)
  std::uint64_t seed;
  std::filesystem::path folder;  ///< base of relative paths
  bool any_order = false;        ///< times may go back or repeat; the run orders the frames
  /// The whole config and the host with the plugins that it names, for a source that simulates its
  /// models. Null if only the keys are requested.
  const Config* config = nullptr;
  const PluginHost* host = nullptr;
};

}  // namespace alidade
