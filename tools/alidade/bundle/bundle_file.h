// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "alidade/base/timestamp.h"
#include "alidade/bundle/bundle.h"

/// Files of bundle adjustment problems.
///
///   format   content                                              viewing direction
///   bal      text: counts, `camera point u v` each, then 9 numbers a camera (angle-axis and t of
///            cam_from_world, f, k1, k2), 3 a point                -z, y up
///   bundler  text: `# Bundle file v0.3`                           -z, y up
///   libmv    binary, of 32-bit numbers; one camera f, c, k, p for all                +z, y down
///   tracks   `frame,feature,dim,value`; calibration and start in separate files          +z
///
/// In the problem, a camera always looks along +z with y down, and v grows downwards.
namespace alidade {
enum class BundleFormat { kBal, kBundler, kLibmv, kTracks };
/// Returns `bal`, `bundler`, `libmv` or `tracks`.
const char* ToString(BundleFormat format);

/// A problem and the other contents of its file, which are needed to write the file again.
struct BundleFile {
  BundleFormat format = BundleFormat::kBal;
  BundleProblem problem;

  /// A pose as the numbers of the file. They are written again if the camera has not moved.
  struct Pose {
    BundleCamera camera;
    std::vector<double> numbers;
    bool registered = true;  ///< false: bundler has no pose of this camera
  };
  std::vector<Pose> poses;
  std::vector<std::string> colours;      ///< bundler: colour of each point
  std::vector<std::int64_t> keys;        ///< bundler: key of each observation
  std::vector<std::int64_t> camera_ids;  ///< libmv: image; tracks: frame; else empty
  std::vector<std::int64_t> point_ids;   ///< libmv: track; tracks: feature; else empty
  std::vector<Timestamp> timestamps;     ///< tracks: timestamp of each camera; else empty
  // Numbers of excluded items, for tracks only.
  int points_left_out = 0;        ///< points that could not be triangulated
  int frames_left_out = 0;        ///< frames without a pose
  int unplaced_observations = 0;  ///< observations of these points and frames
  int invalid_observations = 0;   ///< observations that the sensor model finds invalid
};

/// Reads a problem. The beginning of the file determines the format: bal, bundler or libmv. `-` is
/// standard input. Errors: kInputMissing; kBadData with the position in the file.
BundleFile ReadBundle(const std::filesystem::path& file);

/// Input files of a problem of tracks.
struct BundleTracks {
  std::filesystem::path tracks;  ///< `frame,feature,dim,value`
  std::filesystem::path camera;  ///< YAML with `camera`; a stereo pair has `camera.baseline_m`
  std::filesystem::path start;   ///< trajectory TUM, `t x y z qx qy qz qw`, world_from_cam
};

/// Reads tracks of one camera (dim 0, 1) or of a rectified pair (0 to 3). Frames have the
/// timestamps of `timestamps.csv` in the folder of the tracks; a pose belongs to a frame if their
/// times differ by at most 1 us. Without that file, or from standard input (`-`), pose k belongs to
/// frame k. Frames without a pose are excluded. Points are triangulated from the initial poses by
/// the inverse measurement model of the sensor, which `host` creates. Points that cannot be
/// triangulated are excluded. Errors: kInputMissing, kBadData, kBadConfig, kPlugin.
BundleFile ReadBundleTracks(const BundleTracks& sources, const PluginHost& host);

/// Returns the problem in its own file format. Numbers have the shortest form that reads back
/// exactly (libmv: the nearest 32-bit number). Tracks are not supported: they contain no poses.
std::string BundleText(const BundleFile& file);

}  // namespace alidade
