// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>

#include "alidade/bundle/bundle_file.h"

namespace alidade {
namespace internal {
class OutputFolder;
}

/// Output folder of a bundle adjustment.
///
///   file              content
///   problem.EXT       adjusted problem in the format of the input; omitted for tracks. EXT is txt
///                     (bal), out (bundler) or bin (libmv). The files of colmap are in problem/
///   poses.tum         t x y z qx qy qz qw, world_from_cam, of registered cameras; t is the time in
///                     s or the number of the camera
///   points.csv        point,x,y,z
///   poses_before.tum  the same before the adjustment
///   points_before.csv the same before the adjustment
///   observations.csv  camera, point, measured position, residuals before and after
///   iterations.csv    cost of each step of the solver
///   bundle.json       result of AdjustBundle(), and the counts of excluded items
///   report.html       interactive page
///
/// The folder appears after all files have been written. `force` replaces an existing folder. The
/// constructor reserves the path, so a conflict is reported before the problem is solved.
class BundleFolder {
 public:
  /// Reserves the path. Errors: kCannotCreate, kIo.
  BundleFolder(const std::filesystem::path& folder, bool force);
  ~BundleFolder();

  /// Writes the files. `file` contains the adjusted problem, `start` the problem before the
  /// adjustment. Call this function once. Errors: kCannotCreate, kIo.
  void Save(const BundleFile& file, const BundleProblem& start, const SensorModel& sensor,
            const BundleResult& result);

 private:
  std::unique_ptr<internal::OutputFolder> output_;
};

}  // namespace alidade
