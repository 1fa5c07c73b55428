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

/// The true values at one timestamp, one for each entry of Source::truths() and of its size; what
/// is empty, or lacks at the end, is unknown.
using Truth = std::vector<std::vector<double>>;

/// What a source gives: a frame, and the truth that it is compared with.
struct SourceFrame : Frame {
  Truth truth = {};
};

/// An image, 8 bit grey, row by row from the top.
struct GreyImage {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;
};

/// An image that measurements were taken from, of the left camera of a pair.
struct SeenImage {
  GreyImage grey;
  /// Corners (u, v), px, of the target that was measured in it; none: there is none, or it is lost.
  std::vector<std::array<double, 2>> outline = {};
};

/// What a filter expects of a measurement of size m.
struct Expected {
  std::vector<double> z;  ///< h; empty: it cannot tell
  std::vector<double> s;  ///< S = H P H' + R, m x m
};

/// What a filter expects that a source will measure, lent to a source that looks for it there:
/// active search [Davison2007].
class Guide {
 public:
  virtual ~Guide() = default;
  /// Of each of the landmarks, what `stream`, an index into Source::streams(), will be at
  /// `timestamp`. The filter stays as it is.
  virtual std::vector<Expected> Expect(int stream, Timestamp timestamp,
                                       const std::vector<std::int64_t>& landmarks) const = 0;
};

/// Where measurements come from: a simulator, a file, a pipe. A C++ plugin.
class Source {
 public:
  virtual ~Source() = default;
  virtual const std::vector<StreamInfo>& streams() const = 0;
  /// Values that the source knows, named like the blocks they are truth of.
  virtual const std::vector<StreamInfo>& truths() const = 0;
  /// Fills `frame` with the next one; false at the end. Its streams are indices into streams(), its
  /// values as many as streams() and truths() say: what is not ends the run as internal.
  /// Errors: kBadData, kIo.
  virtual bool Next(SourceFrame& frame) = 0;
  /// The estimator, a filter, that guides it, as its key `guide` names it; empty: none.
  virtual std::string guided_by() const { return {}; }
  /// Lends it the guide that it asks for, for the frames from now on; null takes it back. A source
  /// that has none, as in `alidade simulate`, measures without.
  virtual void LendGuide(const Guide* /*guide*/) {}
  /// Where the landmark of that id is in the world, m, where the source knows the true map.
  virtual std::optional<std::array<double, 3>> TrueLandmark(std::int64_t /*id*/) const {
    return std::nullopt;
  }
  /// How many cameras of a simulated world can draw what they see: 0, 1, or 2 of a stereo pair.
  virtual int views() const { return 0; }
  /// What camera `view` sees at the last frame: 0, the left one of a pair, or 1.
  virtual GreyImage Draw(int /*view*/) { return {}; }
  /// Whether it measures in images, which Seen() gives.
  virtual bool sees() const { return false; }
  /// The image that the last frame was measured in.
  virtual SeenImage Seen() const { return {}; }
  /// The calibration of the camera that took the data: a config of the one map `calibration`, with
  /// parameters under the keys by which models ask for them,
  /// `calibration: {camera: {fx: 721.5, baseline_m: 0.54}}`. None: the data bring none. Errors:
  /// kBadData, kInputMissing.
  virtual std::optional<Config> Calibration() const { return std::nullopt; }
  /// Frames in all, or -1 where that is not known (for progress only).
  virtual std::int64_t size() const { return -1; }
  /// Where the last frame is written, for messages; empty where that means nothing.
  virtual Place place() const { return {}; }
};

class PluginHost;  // in alidade/plugin/plugin_host.h

/// What a source is made from.
struct SourceArguments {
  Node entry;      ///< the config's `source` map
  Params& params;  ///< the same map, read by declaration (numbers, flags, choices)
  std::uint64_t seed;
  std::filesystem::path folder;  ///< relative paths are taken from here
  bool any_order = false;        ///< times may go back or repeat: the run deals with it
  /// All of the config and the plugins that make its models, for a source that draws from them:
  /// those alone that the config names. Null where only the keys are asked for.
  const Config* config = nullptr;
  const PluginHost* host = nullptr;
};

}  // namespace alidade
