// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Core>
#include <algorithm>
#include <map>
#include <optional>

#include "alidade/bundle/bundle_file.h"
#include "alidade/experiment/calibration_file.h"
#include "alidade/io/number_rows.h"
#include "alidade/model/geometry.h"
#include "alidade/state/dense_algebra.h"

namespace alidade {
namespace {

/// Reads the next row and checks that it has the `count` columns `names`. Skips a header that
/// begins with `frame`. Returns false at the end of the file.
bool NextRow(NumberRows& rows, std::size_t count, const char* names) {
  const bool first = rows.line() == 0;
  if (!rows.Next() || (first && rows.text(0) == "frame" && !rows.Next())) return false;
  rows.ExpectColumns(count, names);
  return true;
}

/// Measurement of one feature in one frame: the value and the line number of each dim.
struct TrackEntry {
  std::array<double, 4> z{};
  std::array<int, 4> lines{};  ///< line number of each value in the file; 0: no value
};
using Tracks = std::map<std::int64_t, std::map<std::int64_t, TrackEntry>>;  // keys: frame, feature

Tracks ReadTracks(const std::filesystem::path& path, int& dims) {
  Tracks tracks;
  NumberRows rows(path, {}, {});
  while (NextRow(rows, 4, "frame,feature,dim,value")) {
    const std::int64_t dim = rows.Index(2, "dim");
    if (dim > 3) rows.FailCell(2, "dim", "is unknown", "0 (u), 1 (v), 2 (u_right) or 3 (v_right)");
    TrackEntry& entry = tracks[rows.Index(0, "frame")][rows.Index(1, "feature")];
    const auto d = static_cast<std::size_t>(dim);
    if (entry.lines[d] != 0) {
      rows.FailLine("frame, feature and dim equal those of line " + std::to_string(entry.lines[d]),
                    "one row for each frame, feature and dim");
    }
    entry.z[d] = rows.Number(3, "value");
    entry.lines[d] = rows.line();
    dims = std::max(dims, dim > 1 ? 4 : 2);
  }
  if (tracks.empty()) rows.FailLine("the file contains no rows", "frame,feature,dim,value");
  for (const auto& [frame, features] : tracks) {
    for (const auto& [feature, entry] : features) {
      for (int d = 0; d < dims; ++d) {
        if (entry.lines[static_cast<std::size_t>(d)] != 0) continue;
        const Place place{rows.name(), *std::ranges::max_element(entry.lines)};
        throw Error(
            ExitCode::kBadData,
            ErrorLine(place, {},
                      "in frame " + std::to_string(frame) + ", feature " + std::to_string(feature) +
                          " has no row with dim " + std::to_string(d),
                      "a row for each dim from 0 to " + std::to_string(dims - 1)));
      }
    }
  }
  return tracks;
}

/// Initial poses.
struct Start {
  std::vector<Timestamp> timestamps;
  std::vector<BundleCamera> cameras;
};

Start ReadStart(const std::filesystem::path& path) {
  Start start;
  NumberRows rows(path, {}, {}, ' ');
  while (rows.Next()) {
    rows.ExpectColumns(8, "t x y z qx qy qz qw");
    start.timestamps.push_back(rows.Time(0, "t"));
    const auto [x, y, z, qx, qy, qz, qw] = PoseNumbers(rows, kTumPose);
    BundleCamera& camera = start.cameras.emplace_back(BundleCamera{{x, y, z}, {qw, qx, qy, qz}});
    UnitQuaternion::Normalise(camera.orientation.data());
  }
  return start;
}

/// Finds the index of the pose of each frame. `times` is the file of timestamps. If this file does
/// not exist, pose k belongs to frame k.
std::map<std::int64_t, std::size_t> PosesOf(const Tracks& tracks, const Start& start,
                                            const std::filesystem::path& times) {
  std::map<std::int64_t, std::size_t> poses;
  if (!std::filesystem::exists(times)) {
    for (const auto& [frame, features] : tracks) {
      if (frame < std::ssize(start.cameras)) poses[frame] = static_cast<std::size_t>(frame);
    }
    return poses;
  }
  std::map<Timestamp, std::size_t> pose_at;
  for (std::size_t i = 0; i < start.timestamps.size(); ++i) pose_at.emplace(start.timestamps[i], i);
  constexpr Timestamp kTolerance = 1000;  // 1000 ns = 1 us
  NumberRows rows(times, {}, {});
  while (NextRow(rows, 2, "frame,t_s")) {
    const Timestamp t = rows.Time(1, "t_s");
    const auto found = pose_at.lower_bound(t - kTolerance);
    if (found != pose_at.end() && found->first <= t + kTolerance)
      poses[rows.Index(0, "frame")] = found->second;
  }
  if (rows.line() < 2) rows.FailLine("the file contains no rows", "frame,t_s");
  return poses;
}

/// Computes the pseudo-inverse A^+ of a symmetric, positive semi-definite A. Eigenvalues up to
/// `tolerance` times the largest eigenvalue count as zero.
Eigen::Matrix3d PseudoInverse(const Eigen::Matrix3d& a, double tolerance) {
  const auto [values, vectors] = internal::EigenOf(a);
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Zero();
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (!(values[i] > tolerance * values[2])) continue;
    inverse += vectors.col(i) * vectors.col(i).transpose() / values[i];
  }
  return inverse;
}

/// Triangulates a point from the inverse measurement y of each observation, with J = dy/dz:
///
///   point = (sum W)^-1 sum W y,   W = (J J')^+
///
/// An observation of a single camera constrains the point only across the ray. The weight of a
/// stereo pair along the ray decreases with the distance of y. Returns nullopt if the rays are
/// almost parallel.
std::optional<std::array<double, 3>> Triangulate(
    const SensorModel& sensor, const BundleProblem& problem,
    const std::vector<BundleObservation>& observations) {
  constexpr double kParallel = 1e-6;  // squared sine of an angle of 0.06 degrees
  constexpr double kAlongRay = 1e-12;
  const BundleRoles roles = RolesOf(sensor);
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor> j(
      3, sensor.measurement().geometry.tangent);
  for (const BundleObservation& observation : observations) {
    std::vector<const double*> values(3);
    const BundleCamera& camera = problem.cameras[static_cast<std::size_t>(observation.camera)];
    values[roles.position] = camera.position.data();
    values[roles.orientation] = camera.orientation.data();
    Eigen::Vector3d y;
    const double prior = 1.0;
    const SensorModel::InverseOutput out{.y = y.data(), .jz = j.data()};
    if (sensor.Initialise(values.data(), {observation.z.data()}, &prior, out) != Status::kOk)
      continue;
    const Eigen::Matrix3d w = PseudoInverse(j * j.transpose(), kAlongRay);
    a += w;
    b += w * y;
  }
  const Eigen::VectorXd eigenvalues = internal::EigenvaluesOf(a);
  if (!(eigenvalues[0] > kParallel * eigenvalues[2])) return std::nullopt;
  std::array<double, 3> point;
  Eigen::Map<Eigen::Vector3d>{point.data()} = PseudoInverse(a, 0.0) * b;
  return point;
}

/// Creates the sensor of a problem in the format `tracks` from the calibration file. Errors contain
/// the name of this file. Sets `text` to the YAML of the sensor.
SharedSensor TrackSensor(const BundleTracks& sources, int dims, const PluginHost& host,
                         std::string& text) {
  const Config calibration = ReadCalibrationFile(sources.camera, {.noise = true});
  const char* const model = dims == 4 ? "stereo_feature" : "inverse_depth_feature";
  Config config = Config::FromText("model: " + std::string(model), sources.camera.string())
                      .Merged(calibration.root().At("calibration"));
  const bool has_noise =
      config.root().HasUnread("sigma_px") || config.root().HasUnread("covariance");
  if (!has_noise) config.Set("sigma_px", "1", "bundle");
  const SharedSensor sensor = host.CreateSensor(model, config.root(), "xyz");
  for (const char* key : {"model", "vehicle_from_cam"}) config.root().Declare(key);
  config.root().At("camera").Declare("baseline_m");  // one camera of a pair
  config.root().RejectUnread();
  text = config.ToYaml();
  return sensor;
}

}  // namespace

BundleFile ReadBundleTracks(const BundleTracks& sources, const PluginHost& host) {
  BundleFile file;
  file.format = BundleFormat::kTracks;
  BundleProblem& problem = file.problem;
  int dims = 2;
  const Tracks tracks = ReadTracks(sources.tracks, dims);
  const Start start = ReadStart(sources.start);
  const auto poses = PosesOf(
      tracks, start, sources.tracks == "-" ? "" : sources.tracks.parent_path() / "timestamps.csv");
  const SharedSensor sensor = TrackSensor(sources, dims, host, problem.sensor);

  std::map<std::int64_t, std::vector<BundleObservation>> features;
  for (const auto& [frame, entries] : tracks) {
    const auto pose = poses.find(frame);
    if (pose == poses.end()) {
      ++file.frames_left_out;
      file.unplaced_observations += static_cast<int>(entries.size());
      continue;
    }
    const int camera = static_cast<int>(problem.cameras.size());
    problem.cameras.push_back(start.cameras[pose->second]);
    file.camera_ids.push_back(frame);
    file.timestamps.push_back(start.timestamps[pose->second]);
    for (const auto& [feature, entry] : entries) {
      if (sensor->Valid({entry.z.data()}) == Status::kOk) {
        features[feature].push_back({camera, 0, entry.z, true});
      } else {
        ++file.invalid_observations;
      }
    }
  }
  for (auto& [feature, observations] : features) {
    const auto point = Triangulate(*sensor, problem, observations);
    if (!point) {
      ++file.points_left_out;
      file.unplaced_observations += static_cast<int>(observations.size());
      continue;
    }
    for (BundleObservation& observation : observations) {
      observation.point = static_cast<int>(problem.points.size());
      problem.observations.push_back(observation);
    }
    problem.points.push_back(*point);
    file.point_ids.push_back(feature);
  }
  if (problem.cameras.empty()) {
    throw Error(ExitCode::kBadData,
                ErrorLine(Place{sources.start.string()}, {}, "no pose has the timestamp of a frame",
                          "the timestamps of timestamps.csv in the folder of the tracks"));
  }
  return file;
}

}  // namespace alidade
