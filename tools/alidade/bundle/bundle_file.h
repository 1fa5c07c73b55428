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
///   format   what it is                                           camera looks along
///   bal      text: counts, `camera point u v` each, then 9 numbers a camera (angle-axis and t of
///            cam_from_world, f, k1, k2), 3 a point                -z, y up
///   bundler  text: `# Bundle file v0.3`                           -z, y up
///   libmv    binary, of 32-bit numbers; one camera f, c, k, p for all                +z, y down
///   tracks   `frame,feature,dim,value`; calibration and start from files of their own    +z
///
/// Whatever the file's, in the problem a camera looks along +z, y down, v grows downwards.
namespace alidade {
enum class BundleFormat { kBal, kBundler, kLibmv, kTracks };
/// `bal`, `bundler`, `libmv`, `tracks`.
const char* ToString(BundleFormat format);

/// A problem, and what its file has besides, so that it can be written again.
struct BundleFile {
  BundleFormat format = BundleFormat::kBal;
  BundleProblem problem;

  /// A pose in the numbers of the file. They are written again where the camera has not moved.
  struct Pose {
    BundleCamera camera;
    std::vector<double> numbers;
    bool registered = true;  ///< false: bundler has no pose of this camera
  };
  std::vector<Pose> poses;
  std::vector<std::string> colours;      ///< bundler: of the points
  std::vector<std::int64_t> keys;        ///< bundler: of the observations
  std::vector<std::int64_t> camera_ids;  ///< libmv, tracks: image, frame; else empty
  std::vector<std::int64_t> point_ids;   ///< libmv, tracks: track, feature; else empty
  std::vector<Timestamp> timestamps;     ///< tracks: of the cameras; else empty
  int points_left_out = 0;               ///< tracks: without a place that their rays agree on
  int frames_left_out = 0;               ///< tracks: frames without a pose
  int unplaced = 0;  ///< tracks: observations of these points and frames, left out
  int invalid = 0;   ///< tracks: observations that the sensor finds invalid, left out
};

/// Reads a problem in the format that the file's beginning shows: bal, bundler or libmv; `-` is
/// standard input. Errors: kInputMissing; kBadData with the place.
BundleFile ReadBundle(const std::filesystem::path& file);

/// What else a problem of tracks is made from.
struct BundleTracks {
  std::filesystem::path tracks;  ///< `frame,feature,dim,value`
  std::filesystem::path camera;  ///< YAML with `camera`; a stereo pair has `camera.baseline_m`
  std::filesystem::path start;   ///< trajectory TUM, `t x y z qx qy qz qw`, world_from_cam
};

/// Reads tracks of one camera (dim 0, 1) or of a rectified pair (0 to 3). Frames have the
/// timestamps of `timestamps.csv` next to the tracks, and a pose to 1 us; where it is not there, as
/// from standard input (`-`), the k-th pose is that of frame k. Frames without a pose are left out.
/// Points are placed by triangulation from the start, by the inverse measurement models of the
/// sensor that `host` gives; those that it cannot place are left out. Errors: kInputMissing,
/// kBadData, kBadConfig, kPlugin.
BundleFile ReadBundleTracks(const BundleTracks& from, const PluginHost& host);

/// The problem as a file of its own format; numbers in the shortest form that reads back (libmv: to
/// the nearest 32-bit number). Not of tracks, which hold no poses.
std::string BundleText(const BundleFile& file);

}  // namespace alidade
