// SPDX-License-Identifier: Apache-2.0
#include "alidade/bundle/bundle_folder.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "alidade/base/number_text.h"
#include "alidade/io/json.h"
#include "alidade/io/output_folder.h"
#include "alidade/report/page_text.h"

namespace alidade {
namespace {

using internal::AppendNumber;
using internal::OutputFolder;

/// Returns the number of a camera or point in the file of the problem.
std::int64_t IdOf(const std::vector<std::int64_t>& ids, std::size_t index) {
  return ids.empty() ? static_cast<std::int64_t>(index) : ids[index];
}

/// Returns the poses of `problem`, whose cameras are those of `file`.
std::string PosesTum(const BundleFile& file, const BundleProblem& problem) {
  std::string text;
  for (std::size_t i = 0; i < problem.cameras.size(); ++i) {
    if (i < file.poses.size() && !file.poses[i].registered) continue;
    const BundleCamera& camera = problem.cameras[i];
    if (!file.timestamps.empty()) {
      internal::AppendSeconds(text, file.timestamps[i]);
    } else {
      text += std::to_string(IdOf(file.camera_ids, i));
    }
    const auto& q = camera.orientation;
    for (const double value : camera.position) AppendNumber(text += ' ', value);
    for (const double value : {q[1], q[2], q[3], q[0]}) AppendNumber(text += ' ', value);
    text += '\n';
  }
  return text;
}

/// Returns the points of `problem`, which have the numbers of those of `file`.
std::string PointsCsv(const BundleFile& file, const BundleProblem& problem) {
  std::string text = "point,x,y,z\n";
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    text += std::to_string(IdOf(file.point_ids, i));
    for (const double value : problem.points[i]) AppendNumber(text += ',', value);
    text += '\n';
  }
  return text;
}

/// Appends a comma and a number. The cell of NaN is empty.
void AppendCell(std::string& text, double value) {
  text += ',';
  if (!std::isnan(value)) AppendNumber(text, value);
}

std::string ObservationsCsv(const BundleFile& file, const BundleProblem& start,
                            const SensorModel& sensor) {
  const std::vector<std::string>& elements = sensor.measurement().elements;
  std::string text = "camera,point,used";
  for (const char* const quantity : {"measured", "before", "after"}) {
    for (const std::string& element : elements) text += std::string(",") + quantity + '.' + element;
  }
  text += '\n';
  const auto before = BundleResiduals(sensor, start), after = BundleResiduals(sensor, file.problem);
  for (std::size_t i = 0; i < file.problem.observations.size(); ++i) {
    const BundleObservation& observation = file.problem.observations[i];
    const auto camera = static_cast<std::size_t>(observation.camera);
    text += std::to_string(IdOf(file.camera_ids, camera)) + ',' +
            std::to_string(IdOf(file.point_ids, static_cast<std::size_t>(observation.point))) +
            (observation.used ? ",1" : ",0");
    for (const auto* const values : {&observation.z, &before[i], &after[i]}) {
      for (std::size_t k = 0; k < elements.size(); ++k) AppendCell(text, (*values)[k]);
    }
    text += '\n';
  }
  return text;
}

std::string IterationsCsv(const BundleResult& result) {
  std::string text = "iteration,cost,accepted,gradient\n";
  for (std::size_t i = 0; i < result.steps.size(); ++i) {
    const BundleIteration& step = result.steps[i];
    AppendCell(text += std::to_string(i), step.cost);
    AppendCell(text += step.accepted ? ",1" : ",0", step.gradient);
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

std::string ResultJson(const BundleFile& file, const BundleProblem& start,
                       const SensorModel& sensor, const BundleResult& result) {
  internal::Json json = {{"format", ToString(file.format)},
                         {"status", ToString(result.end)},
                         {"message", result.message},
                         {"cameras", file.problem.cameras.size()},
                         {"points", file.problem.points.size()},
                         {"observations", file.problem.observations.size()}};
  AddExclusions(file, json);
  json["rms_before_px"] = BundleRms(sensor, start);
  json["rms_after_px"] = BundleRms(sensor, file.problem);
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
  json["undetermined"] = DescribeUndetermined(file.problem, sensor, result);
  return internal::JsonText(json);
}

}  // namespace

BundleFolder::BundleFolder(const std::filesystem::path& folder, bool force)
    : output_(std::make_unique<OutputFolder>(folder, force)) {}
BundleFolder::~BundleFolder() = default;

void BundleFolder::Save(const BundleFile& file, const BundleProblem& start,
                        const SensorModel& sensor, const BundleResult& result) {
  output_->Write("bundle.json", ResultJson(file, start, sensor, result));
  output_->Write("points.csv", PointsCsv(file, file.problem));
  output_->Write("points_before.csv", PointsCsv(file, start));
  output_->Write("poses.tum", PosesTum(file, file.problem));
  output_->Write("poses_before.tum", PosesTum(file, start));
  output_->Write("observations.csv", ObservationsCsv(file, start, sensor));
  output_->Write("iterations.csv", IterationsCsv(result));
  for (const auto& [name, text] : BundleTexts(file)) output_->Write(name, text);
  internal::CommitWithPage(*output_);
}

}  // namespace alidade
