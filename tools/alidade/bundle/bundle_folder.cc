// SPDX-License-Identifier: Apache-2.0
#include "alidade/bundle/bundle_folder.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "alidade/base/number_text.h"
#include "alidade/io/json.h"
#include "alidade/io/output_folder.h"
#include "alidade/report/page_text.h"

namespace alidade {
namespace {

using internal::AppendNumber;
using internal::OutputFolder;

const char* ExtensionOf(BundleFormat format) {
  constexpr const char* kExtensions[] = {".txt", ".out", ".bin", ""};
  return kExtensions[static_cast<int>(format)];
}

std::string PosesTum(const BundleFile& file) {
  std::string text;
  for (std::size_t i = 0; i < file.problem.cameras.size(); ++i) {
    if (i < file.poses.size() && !file.poses[i].registered) continue;
    const BundleCamera& camera = file.problem.cameras[i];
    if (!file.timestamps.empty()) {
      internal::AppendSeconds(text, file.timestamps[i]);
    } else {
      text += std::to_string(file.camera_ids.empty() ? static_cast<std::int64_t>(i)
                                                     : file.camera_ids[i]);
    }
    const auto& q = camera.orientation;
    for (const double value : camera.position) AppendNumber(text += ' ', value);
    for (const double value : {q[1], q[2], q[3], q[0]}) AppendNumber(text += ' ', value);
    text += '\n';
  }
  return text;
}

std::string PointsCsv(const BundleFile& file) {
  std::string text = "point,x,y,z\n";
  for (std::size_t i = 0; i < file.problem.points.size(); ++i) {
    text +=
        std::to_string(file.point_ids.empty() ? static_cast<std::int64_t>(i) : file.point_ids[i]);
    for (const double value : file.problem.points[i]) AppendNumber(text += ',', value);
    text += '\n';
  }
  return text;
}

/// Adds the counts of the items that were read but are not used in the solution.
void AddExclusions(const BundleFile& file, internal::Json& json) {
  const BundleProblem& problem = file.problem;
  std::vector<bool> camera_used(problem.cameras.size()), point_used(problem.points.size());
  for (const BundleObservation& observation : problem.observations) {
    if (!observation.used) continue;
    camera_used[static_cast<std::size_t>(observation.camera)] = true;
    point_used[static_cast<std::size_t>(observation.point)] = true;
  }
  json["observations_undefined"] =
      std::ranges::count(problem.observations, false, &BundleObservation::used);
  json["cameras_unused"] = std::ranges::count(camera_used, false);
  json["points_unused"] = std::ranges::count(point_used, false);
  if (file.format != BundleFormat::kTracks) return;
  json["observations_invalid"] = file.invalid_observations;
  json["frames_without_pose"] = file.frames_left_out;
  json["points_without_parallax"] = file.points_left_out;
  json["observations_of_these"] = file.unplaced_observations;
}

std::string ResultJson(const BundleFile& file, const BundleResult& result, double rms_before,
                       double rms_after) {
  internal::Json json = {{"format", ToString(file.format)},
                         {"status", ToString(result.end)},
                         {"message", result.message},
                         {"cameras", file.problem.cameras.size()},
                         {"points", file.problem.points.size()},
                         {"observations", file.problem.observations.size()}};
  AddExclusions(file, json);
  json["rms_before_px"] = rms_before;
  json["rms_after_px"] = rms_after;
  json["cost_before"] = result.cost_before;
  json["cost_after"] = result.cost_after;
  json["iterations"] = result.iterations;
  json["residuals"] = result.residuals;
  json["unknowns"] = result.unknowns;
  if (result.extent_before > 0.0) {
    json["extent_before"] = result.extent_before;
    json["extent_after"] = result.extent_after;
  }
  if (result.rank >= 0) json["rank"] = result.rank;
  return internal::JsonText(json);
}

}  // namespace

BundleFolder::BundleFolder(const std::filesystem::path& folder, bool force)
    : output_(std::make_unique<OutputFolder>(folder, force)) {}
BundleFolder::~BundleFolder() = default;

void BundleFolder::Save(const BundleFile& file, const BundleResult& result, double rms_before,
                        double rms_after) {
  output_->Write("bundle.json", ResultJson(file, result, rms_before, rms_after));
  output_->Write("points.csv", PointsCsv(file));
  output_->Write("poses.tum", PosesTum(file));
  if (file.format != BundleFormat::kTracks) {
    output_->Write(std::string("problem") + ExtensionOf(file.format), BundleText(file));
  }
  internal::CommitWithPage(*output_);
}

}  // namespace alidade
