// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
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

/// True values at one timestamp: one vector for each entry of Source::truths(), with the size of
/// that entry. A value is unknown if its vector is empty, or if the list ends before its index.
using Truth = std::vector<std::vector<double>>;

/// Frame of a source, with the truth that metrics compare with the estimates.
struct SourceFrame : Frame {
  Truth truth = {};
};

/// Grey image with 8 bits per pixel, row by row from the top.
struct GreyImage {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;
};

/// Image from which a source obtained measurements. For a stereo pair, it is the image of the left
/// camera.
struct MeasuredImage {
  GreyImage grey;
  /// Corners (u, v) of the measured target, px. Empty if the source does not track a target, or has
  /// lost the target.
  std::vector<std::array<double, 2>> outline = {};
};

/// Expected measurement of size m, with its covariance.
struct ExpectedMeasurement {
  std::vector<double> z;  ///< prediction h; empty if h cannot be computed
  std::vector<double> s;  ///< S = H P H' + R, m x m
};

/// Predictor of measurements, for a source that searches its images near the expected values
/// (active search [Davison2007]).
class Guide {
 public:
  virtual ~Guide() = default;
  /// Predicts the measurement of each landmark at `timestamp`. `stream` is an index into
  /// Source::streams(). The call does not change the filter.
  virtual std::vector<ExpectedMeasurement> Expect(
      int stream, Timestamp timestamp, const std::vector<std::int64_t>& landmarks) const = 0;
};

/// Source of measurements, such as a simulator, a file or a pipe. A source is a C++ plugin.
class Source {
 public:
  virtual ~Source() = default;
  virtual const std::vector<StreamInfo>& streams() const = 0;
  /// Describes the true values that the source provides. Each truth has the name of its block.
  virtual const std::vector<StreamInfo>& truths() const = 0;
  /// Rejects a stream whose unit, if the source knows it, cannot be converted to the unit of the
  /// quantity that reads the stream. `units` contains the unit of each value, or "" if there is no
  /// unit. Must not be called after the config of the source is destroyed. Errors: kBadConfig.
  virtual void CheckUnits(std::size_t /*stream*/, const std::vector<std::string>& /*units*/,
                          const std::string& /*quantity*/) const {}
  /// Reads the next frame. Returns false at the end. The streams of the measurements must be
  /// indices into streams(). All values must have the sizes that streams() and truths() state. Any
  /// other frame ends the run with an internal error. Errors: kBadData, kIo.
  virtual bool Next(SourceFrame& frame) = 0;
  /// Returns the name of the filter that guides this source, as in the key `guide`. Returns "" if
  /// no filter guides this source.
  virtual std::string guide_name() const { return {}; }
  /// Sets the requested guide for the following frames; null removes the guide. Without a guide, as
  /// in `alidade simulate`, the source must measure without predictions.
  virtual void SetGuide(const Guide* /*guide*/) {}
  /// Returns the true position of a landmark in the world, m; nullopt if the position is unknown.
  virtual std::optional<std::array<double, 3>> TrueLandmark(std::int64_t /*id*/) const {
    return std::nullopt;
  }
  /// Returns the number of simulated cameras that can draw images: 0, 1, or 2 for a stereo pair.
  virtual int views() const { return 0; }
  /// Draws the image that camera `view` sees at the last frame. Camera 0 is the left camera of a
  /// pair.
  virtual GreyImage Draw(int /*view*/) { return {}; }
  /// Returns whether the source obtains its measurements from images. If so, LastImage() returns
  /// them.
  virtual bool measures_images() const { return false; }
  /// Returns the image from which the last frame was measured.
  virtual MeasuredImage LastImage() const { return {}; }
  /// Returns the calibration of the camera that recorded the data, if the data contain one. The
  /// calibration is a config with one map `calibration`, which has the keys that models read:
  /// `calibration: {camera: {fx: 721.5, baseline_m: 0.54}}`. Errors: kBadData, kInputMissing.
  virtual std::optional<Config> Calibration() const { return std::nullopt; }
  /// Returns the total number of frames, or -1 if it is unknown. Only progress reports use this
  /// number.
  virtual std::int64_t size() const { return -1; }
  /// Returns the place of the last frame in its file, for messages. The place is empty if there is
  /// no file.
  virtual Place place() const { return {}; }
};

class PluginHost;  // defined in alidade/plugin/plugin_host.h

/// Arguments of the factory of a source.
struct SourceArguments {
  Node entry;  ///< the config's `source` map
  /// Reader of `entry`. The reader also declares each parameter (numbers, flags, choices).
  Params& params;
  std::uint64_t seed;
  std::filesystem::path folder;  ///< folder to which relative paths refer
  /// True if timestamps may repeat or decrease; the run then orders the frames.
  bool any_order = false;
  /// `config` is the whole config, and `host` has the plugins that the config names. A source that
  /// simulates models needs both. Both are null if only the keys of the source are requested.
  const Config* config = nullptr;
  const PluginHost* host = nullptr;
};

}  // namespace alidade
