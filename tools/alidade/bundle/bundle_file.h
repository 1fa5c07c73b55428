// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "alidade/base/timestamp.h"
#include "alidade/bundle/bundle.h"

/// Files of bundle adjustment problems.
///
///   format   content                                              viewing direction
///   bal      text: counts; `camera point u v` for each observation; 9 numbers for each camera
///            (angle-axis and t of cam_from_world, f, k1, k2); 3 numbers for each point
///                                                                 -z, y up
///   bundler  text: `# Bundle file v0.3`                           -z, y up
///   colmap   folder with cameras.txt, images.txt and points3D.txt: qw qx qy qz and t of
///            cam_from_world; lenses shared by images       +z, y down
///   libmv    binary: 32-bit numbers; one lens f, c, k, p for all images               +z, y down
///   tracks   `frame,feature,dim,value`; calibration and initial poses in other files  +z, y down
///
/// In the problem, a camera always looks along +z with y down, and v grows downwards. Pixels have
/// the origin of the file. In COLMAP, the centre of the upper left pixel is (0.5, 0.5).
namespace alidade {
enum class BundleFormat { kBal, kBundler, kLibmv, kTracks, kColmap };
/// Returns `bal`, `bundler`, `libmv`, `tracks` or `colmap`.
const char* ToString(BundleFormat format);

/// Problem, and the other contents of its file, which are needed to write the file again.
struct BundleFile {
  BundleFormat format = BundleFormat::kBal;
  BundleProblem problem;

  /// Pose of a camera, and the numbers of this pose in the file. If the camera has not moved, the
  /// same numbers are written again.
  struct Pose {
    BundleCamera camera;
    std::vector<double> numbers;
    bool registered = true;  ///< false: the file does not contain a pose (bundler)
  };
  std::vector<Pose> poses;
  std::vector<std::string> colours;      ///< bundler, colmap: colour of each point
  std::vector<std::int64_t> keys;        ///< bundler: key of each observation
  std::vector<std::int64_t> camera_ids;  ///< libmv, colmap: image; tracks: frame; otherwise empty
  std::vector<std::int64_t> point_ids;   ///< libmv, colmap, tracks: id of the point; else empty
  std::vector<Timestamp> timestamps;     ///< tracks: timestamp of each camera; otherwise empty
  /// colmap: a camera of the file, in px.
  struct Lens {
    std::int64_t id, width, height;
  };
  std::vector<Lens> lenses;              ///< colmap: in the order of the intrinsics
  std::string lens_model;                ///< colmap: model of all lenses
  std::size_t lens_parameters = 0;       ///< colmap: number of parameters of the model
  std::vector<std::string> image_names;  ///< colmap: of each camera
  /// colmap: feature of an image. Its point is -1 if it belongs to no point.
  struct Feature {
    std::array<double, 2> z;
    int point;
  };
  std::vector<std::vector<Feature>> features;  ///< colmap: features of each image
  // Numbers of excluded items. They are 0 for all formats except tracks.
  int points_left_out = 0;        ///< points that could not be triangulated
  int frames_left_out = 0;        ///< frames without a pose
  int unplaced_observations = 0;  ///< observations of the excluded points and frames
  int invalid_observations = 0;   ///< observations that the sensor model rejects
};

/// Reads a problem. The beginning of the file determines the format: bal, bundler or libmv. The
/// format of a folder is colmap. `-` is standard input. Errors: kInputMissing; kBadData with the
/// position in the file.
BundleFile ReadBundle(const std::filesystem::path& file);

/// Input files of a problem in the format `tracks`.
struct BundleTracks {
  std::filesystem::path tracks;  ///< file with rows `frame,feature,dim,value`
  std::filesystem::path camera;  ///< calibration; a stereo pair has `camera.baseline_m`
  std::filesystem::path start;   ///< TUM file, `t x y z qx qy qz qw`, world_from_cam
};

/// Reads tracks of one camera (dim 0, 1) or of a rectified pair (0 to 3). Frames have the
/// timestamps of `timestamps.csv` in the folder of the tracks. A pose belongs to a frame if the
/// times of both differ by at most 1 us. If this file does not exist, or if the tracks are read
/// from standard input (`-`), pose k belongs to frame k. Frames without a pose are excluded. `host`
/// creates the sensor. Points are triangulated from the initial poses with the inverse measurement
/// model of the sensor. Points that cannot be triangulated are excluded. Errors: kInputMissing,
/// kBadData, kBadConfig, kPlugin.
BundleFile ReadBundleTracks(const BundleTracks& sources, const PluginHost& host);

/// Returns the text of the problem in the format of its file. Numbers have the shortest form that
/// reads back exactly (libmv: the nearest 32-bit number). Formats of several files are not
/// supported.
std::string BundleText(const BundleFile& file);

/// Returns the files of the problem in its format, as pairs of a path and a text: `problem.txt`
/// (bal), `problem.out` (bundler), `problem.bin` (libmv) or three files in `problem/` (colmap).
/// Returns no files for tracks, because a file of tracks does not contain poses.
std::vector<std::pair<std::string, std::string>> BundleTexts(const BundleFile& file);

}  // namespace alidade
