// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "alidade/base/error.h"
#include "alidade/evaluate/trajectory.h"

namespace alidade {
namespace fs = std::filesystem;
namespace {

constexpr const char* kTruth = "truth.tum";
constexpr const char* kTrajectory = "trajectory.tum";
constexpr const char* kWithCovariance = "trajectory_covariance.tum";
constexpr const char* kEurocReference = "state_groundtruth_estimate0/data.csv";

bool IsFile(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

bool IsFolder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

[[noreturn]] void FailMissing(const fs::path& folder, const std::string& what,
                              const std::string& expected) {
  throw Error(ExitCode::kInputMissing, ErrorLine({folder.string()}, {}, what, expected));
}

/// `runs/slam/` is called slam.
std::string NameOf(const fs::path& folder) {
  return folder.filename().empty() ? folder.parent_path().filename().string()
                                   : folder.filename().string();
}

/// The trajectory that an estimator left in its folder; an empty path where it left none.
TrajectoryFile OfEstimator(const fs::path& folder) {
  for (const char* name : {kWithCovariance, kTrajectory}) {
    if (!IsFile(folder / name)) continue;
    const fs::path innovations = folder / "innovations.csv";
    return {folder / name, NameOf(folder), IsFile(innovations) ? innovations : fs::path()};
  }
  return {};
}

}  // namespace

TrajectoryFile ReferenceAt(const fs::path& path) {
  const auto named = [](const fs::path& file) {
    return TrajectoryFile{file, file.stem().string(), {}};
  };
  if (!IsFolder(path)) return named(path);
  for (const fs::path& file : {path / kTruth, path / "groundtruth.tum",
                               path / "mav0" / kEurocReference, path / kEurocReference}) {
    if (IsFile(file)) return named(file);
  }
  FailMissing(path, "no reference in this folder",
              "truth.tum of a run whose source knows a pose, or mav0/ of EuRoC; or name the file");
}

TrajectoryFile TruthOf(const fs::path& path) {
  if (!IsFolder(path)) {
    std::error_code error;
    if (!fs::exists(path, error)) FailMissing(path, "no such folder", "the folder of a run");
    throw Error(ExitCode::kUsage,
                ErrorLine({path.string()}, {}, "one file has nothing to be compared with",
                          "REF EST, or the folder of a run"));
  }
  std::vector<fs::path> places = {path / kTruth};
  if (!OfEstimator(path).file.empty()) {
    places.push_back((path / "..").lexically_normal() / kTruth);
  }
  for (const fs::path& file : places) {
    if (IsFile(file)) return {file, file.stem().string(), {}};
  }
  FailMissing(path, std::string("no ") + kTruth + " in this run",
              "a run whose source knows a pose; or REF EST");
}

std::vector<TrajectoryFile> EstimatesAt(const fs::path& path) {
  if (!IsFolder(path)) return {{path, path.stem().string(), {}}};
  std::vector<TrajectoryFile> found;
  if (TrajectoryFile own = OfEstimator(path); !own.file.empty()) return {own};
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(path, error)) {
    if (!entry.is_directory(error)) continue;
    if (TrajectoryFile one = OfEstimator(entry.path()); !one.file.empty()) found.push_back(one);
  }
  std::ranges::sort(found, {}, &TrajectoryFile::label);
  if (!found.empty()) return found;
  FailMissing(path, "no trajectory in this folder",
              std::string("NAME/") + kTrajectory +
                  " of an estimator with blocks X.position and X.orientation, or X.heading of a "
                  "planar pose; or name the file");
}

}  // namespace alidade
