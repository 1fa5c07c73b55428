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

[[noreturn]] void FailMissing(const fs::path& folder, const std::string& problem,
                              const std::string& expected) {
  throw Error(ExitCode::kInputMissing, ErrorLine({folder.string()}, {}, problem, expected));
}

/// Returns the name of a folder, as in `slam` for `runs/slam/`.
std::string NameOf(const fs::path& folder) {
  return folder.filename().empty() ? folder.parent_path().filename().string()
                                   : folder.filename().string();
}

/// Finds the trajectory in the folder of an estimator. Returns an empty path if it does not exist.
TrajectoryFile EstimatorTrajectory(const fs::path& folder) {
  for (const char* name : {kWithCovariance, kTrajectory}) {
    if (!IsFile(folder / name)) continue;
    const fs::path innovations = folder / "innovations.csv";
    return {folder / name, NameOf(folder), IsFile(innovations) ? innovations : fs::path()};
  }
  return {};
}

}  // namespace

TrajectoryFile ReferenceAt(const fs::path& path) {
  const auto labelled = [](const fs::path& file) {
    return TrajectoryFile{file, file.stem().string(), {}};
  };
  if (!IsFolder(path)) return labelled(path);
  for (const fs::path& file : {path / kTruth, path / "groundtruth.tum",
                               path / "mav0" / kEurocReference, path / kEurocReference}) {
    if (IsFile(file)) return labelled(file);
  }
  FailMissing(path, "this folder does not contain a reference trajectory",
              "truth.tum of a run whose source provides true poses, mav0/ of EuRoC, or a file");
}

TrajectoryFile TruthOf(const fs::path& path) {
  if (!IsFolder(path)) {
    std::error_code error;
    if (!fs::exists(path, error))
      FailMissing(path, "the folder does not exist", "the folder of a run");
    throw Error(ExitCode::kUsage,
                ErrorLine({path.string()}, {}, "a single file cannot be evaluated",
                          "two files REF EST, or the folder of a run"));
  }
  std::vector<fs::path> candidates = {path / kTruth};
  if (!EstimatorTrajectory(path).file.empty()) {
    candidates.push_back((path / "..").lexically_normal() / kTruth);
  }
  for (const fs::path& file : candidates) {
    if (IsFile(file)) return {file, file.stem().string(), {}};
  }
  FailMissing(path, std::string("this run does not contain ") + kTruth,
              "a run whose source provides true poses, or two files REF EST");
}

std::vector<TrajectoryFile> EstimatesAt(const fs::path& path) {
  if (!IsFolder(path)) return {{path, path.stem().string(), {}}};
  std::vector<TrajectoryFile> found;
  if (TrajectoryFile trajectory = EstimatorTrajectory(path); !trajectory.file.empty())
    return {trajectory};
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(path, error)) {
    if (!entry.is_directory(error)) continue;
    if (TrajectoryFile trajectory = EstimatorTrajectory(entry.path()); !trajectory.file.empty())
      found.push_back(trajectory);
  }
  std::ranges::sort(found, {}, &TrajectoryFile::label);
  if (!found.empty()) return found;
  FailMissing(
      path, "this folder does not contain a trajectory",
      std::string("NAME/") + kTrajectory +
          " of an estimator with blocks X.position and X.orientation (planar: X.heading), or "
          "a file");
}

}  // namespace alidade
