// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "alidade/bundle/bundle_file.h"

namespace alidade {
namespace internal {
class OutputFolder;
}

/// The folder that a solution goes to.
///
///   file         rows
///   problem.EXT  the problem, adjusted, in its own format: .txt, .out or .bin; not of tracks
///   poses.tum    t x y z qx qy qz qw, world_from_cam; t in s, or the number of the camera; not of
///                cameras that are not registered
///   points.csv   point,x,y,z
///   bundle.json  the result of AdjustBundle, and how much was left out of what was read
///
/// It appears when all is written; one that is there is replaced where `force`. Made before the
/// problem is solved, it tells in time what is in its way, and keeps others from its place.
class BundleFolder {
 public:
  /// Errors: kCannotCreate, kIo.
  BundleFolder(const std::filesystem::path& folder, bool force);
  ~BundleFolder();

  /// Returns the names of the files; once. Errors: kCannotCreate, kIo.
  std::vector<std::string> Save(const BundleFile& file, const BundleResult& result,
                                double rms_before, double rms_after);

 private:
  std::unique_ptr<internal::OutputFolder> output_;
};

}  // namespace alidade
