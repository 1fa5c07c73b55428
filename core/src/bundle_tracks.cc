// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "alidade/bundle_file.h"
#include "alidade/geometry.h"
#include "alidade/line_reader.h"
#include "alidade/text_cell.h"

namespace alidade {
namespace {

/// The rows of a file of numbers, their places known. `separator` ' ': any blanks. Blank lines,
/// those that begin with `#`, and a first line of names are left out.
class Rows {
 public:
  Rows(const std::filesystem::path& path, char separator, std::size_t columns,
       const std::string& names)
      : reader_(path, Place{path.string()}, {}),
        separator_(separator),
        columns_(columns),
        names_(names) {}

  bool Next() {
    std::string_view line;
    while (reader_.Next(line)) {
      if (line.find_first_not_of(" \t") == line.npos || line.starts_with('#')) continue;
      Split(line);
      double ignored = 0.0;
      const bool header = first_ && separator_ == ',' &&
                          cell::ParseNumber(cell::Trim(cells_[0]), ignored) != nullptr;
      first_ = false;
      if (header) continue;
      if (cells_.size() != columns_)
        Fail(std::to_string(cells_.size()) + " columns", std::to_string(columns_) + ", " + names_);
      return true;
    }
    return false;
  }
  double Number(std::size_t i) const {
    double value = 0.0;
    const char* const wrong = cell::ParseNumber(cell::Trim(cells_[i]), value);
    if (wrong != nullptr) Fail('\'' + cell::Harmless(cells_[i]) + "' " + wrong, "a finite number");
    return value;
  }
  std::int64_t Index(std::size_t i, double most) const {
    const double value = Number(i);
    if (value < 0.0 || value > most || value != std::floor(value)) {
      Fail('\'' + cell::Harmless(cells_[i]) + "' is none",
           "a whole number from 0 to " + std::to_string(static_cast<std::int64_t>(most)));
    }
    return static_cast<std::int64_t>(value);
  }
  Stamp Time(std::size_t i) const { return StampFromSeconds(Number(i)); }
  int line() const { return reader_.number(); }
  [[noreturn]] void Fail(const std::string& what, const std::string& expected) const {
    throw Error(ExitCode::kBadData,
                ErrorLine(Place{reader_.name(), reader_.number(), 1}, {}, what, expected));
  }

 private:
  void Split(std::string_view line) {
    cells_.clear();
    if (separator_ == ',') {
      for (std::size_t comma; (comma = line.find(',')) != line.npos; line.remove_prefix(comma + 1))
        cells_.emplace_back(line.substr(0, comma));
      cells_.emplace_back(line);
      return;
    }
    for (std::size_t at; (at = line.find_first_not_of(" \t")) != line.npos;) {
      line.remove_prefix(at);
      const std::size_t end = std::min(line.find_first_of(" \t"), line.size());
      cells_.emplace_back(line.substr(0, end));
      line.remove_prefix(end);
    }
  }

  LineReader reader_;
  char separator_;
  std::size_t columns_;
  std::string names_;
  bool first_ = true;
  std::vector<std::string> cells_;
};

/// What one frame sees of one feature: values by dim, and the lines that they stand in.
struct Seen {
  std::array<double, 4> z{};
  std::array<int, 4> lines{};
};
using Tracks = std::map<std::int64_t, std::map<std::int64_t, Seen>>;  // frame, feature

Tracks ReadTracks(const std::filesystem::path& path, int& dims) {
  constexpr double kMost = 9007199254740992.0;  // 2^53
  Tracks tracks;
  Rows rows(path, ',', 4, "frame,feature,dim,value");
  while (rows.Next()) {
    const auto dim = static_cast<std::size_t>(rows.Index(2, 3));
    Seen& seen = tracks[rows.Index(0, kMost)][rows.Index(1, kMost)];
    if (seen.lines[dim] != 0)
      rows.Fail("the same frame, feature and dim as line " + std::to_string(seen.lines[dim]),
                "each once");
    seen.z[dim] = rows.Number(3);
    seen.lines[dim] = rows.line();
    dims = std::max(dims, dim > 1 ? 4 : 2);
  }
  if (tracks.empty()) rows.Fail("no rows", "frame,feature,dim,value");
  for (const auto& [frame, features] : tracks) {
    for (const auto& [feature, seen] : features) {
      for (int d = 0; d < dims; ++d) {
        if (seen.lines[static_cast<std::size_t>(d)] != 0) continue;
        rows.Fail("frame " + std::to_string(frame) + " has no dim " + std::to_string(d) +
                      " of feature " + std::to_string(feature),
                  "all of 0 to " + std::to_string(dims - 1));
      }
    }
  }
  return tracks;
}

struct Start {
  std::vector<Stamp> stamps;
  std::vector<BundleCamera> cameras;
};

Start ReadStart(const std::filesystem::path& path) {
  Start start;
  Rows rows(path, ' ', 8, "t x y z qx qy qz qw");
  while (rows.Next()) {
    BundleCamera& camera = start.cameras.emplace_back();
    start.stamps.push_back(rows.Time(0));
    for (std::size_t i = 0; i < 3; ++i) camera.position[i] = rows.Number(1 + i);
    camera.orientation = {rows.Number(7), rows.Number(4), rows.Number(5), rows.Number(6)};
    constexpr double kRounding = 1e-3;
    const Eigen::Map<const Eigen::Vector4d> q(camera.orientation.data());
    if (!(std::abs(q.norm() - 1.0) < kRounding))
      rows.Fail("the quaternion is not of unit length", "qx qy qz qw of length 1 to 0.001");
    Normalise<UnitQuaternion>(camera.orientation.data());
  }
  return start;
}

/// Of each frame the index of its pose.
std::map<std::int64_t, std::size_t> PosesOf(const Tracks& tracks, const Start& start,
                                            const std::filesystem::path& times) {
  std::map<std::int64_t, std::size_t> poses;
  if (!std::filesystem::exists(times)) {
    for (const auto& [frame, features] : tracks) {
      if (frame < std::ssize(start.cameras)) poses[frame] = static_cast<std::size_t>(frame);
    }
    return poses;
  }
  constexpr Stamp kSame = 1000;  // ns
  Rows rows(times, ',', 2, "frame,t_s");
  while (rows.Next()) {
    const Stamp t = rows.Time(1);
    const auto same = [&](Stamp other) { return std::abs(other - t) <= kSame; };
    const auto found = std::ranges::find_if(start.stamps, same);
    if (found != start.stamps.end())
      poses[rows.Index(0, 9e15)] = static_cast<std::size_t>(found - start.stamps.begin());
  }
  return poses;
}

/// The point nearest to the rays of its observations, or the mean where each tells the depth; none
/// where they are all but parallel.
std::optional<std::array<double, 3>> Triangulate(const SensorModel& sensor,
                                                 const BundleProblem& problem,
                                                 const std::vector<BundleObservation>& seen) {
  constexpr double kParallel = 1e-6;  // of the squared sine of an angle, 0.06 degrees
  const BundleRoles roles = RolesOf(sensor);
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const BundleObservation& one : seen) {
    std::vector<const double*> values(3);
    const BundleCamera& camera = problem.cameras[static_cast<std::size_t>(one.camera)];
    values[roles.position] = camera.position.data();
    values[roles.orientation] = camera.orientation.data();
    Eigen::Vector3d y;
    const double prior = 1.0;
    if (sensor.Initialise(values.data(), one.z.data(), &prior, y.data(), nullptr, nullptr,
                          nullptr) != Status::kOk)
      return std::nullopt;
    const Eigen::Map<const Eigen::Vector3d> eye(camera.position.data());
    Eigen::Matrix3d across = Eigen::Matrix3d::Identity();
    if (sensor.prior_size() > 0) {
      const Eigen::Vector3d ray = (y - eye).normalized();
      across -= ray * ray.transpose();
    }
    a += across;
    b += across * y;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(a);
  if (!(solver.eigenvalues()[0] > kParallel * static_cast<double>(seen.size())))
    return std::nullopt;
  std::array<double, 3> point;
  Eigen::Map<Eigen::Vector3d>{point.data()} = a.ldlt().solve(b);
  return point;
}

/// The sensor of tracks, checked while its file is known.
SensorModel MakeSensor(const BundleTracks& from, int dims, const PluginHost& host,
                       std::string& text) {
  Config config = Config::FromFile(from.camera);
  const char* const model = dims == 4 ? "stereo_feature" : "inverse_depth_feature";
  config.Set("model", model, "bundle");
  if (!config.root().HasUnread("sigma_px")) config.Set("sigma_px", "1", "bundle");
  const SensorModel sensor = host.CreateSensor(model, config.root(), "xyz");
  config.root().Declare("model");
  config.root().RejectUnread();
  text = config.ToYaml();
  return sensor;
}

}  // namespace

BundleFile ReadBundleTracks(const BundleTracks& from, const PluginHost& host) {
  BundleFile file;
  file.format = BundleFormat::kTracks;
  BundleProblem& problem = file.problem;
  int dims = 2;
  const Tracks tracks = ReadTracks(from.tracks, dims);
  const Start start = ReadStart(from.start);
  const auto poses = PosesOf(tracks, start, from.tracks.parent_path() / "timestamps.csv");
  const SensorModel sensor = MakeSensor(from, dims, host, problem.sensor);

  std::map<std::int64_t, std::vector<BundleObservation>> features;
  for (const auto& [frame, all] : tracks) {
    const auto pose = poses.find(frame);
    if (pose == poses.end()) continue;
    const int camera = static_cast<int>(problem.cameras.size());
    problem.cameras.push_back(start.cameras[pose->second]);
    file.camera_ids.push_back(frame);
    file.stamps.push_back(start.stamps[pose->second]);
    for (const auto& [feature, seen] : all) {
      if (sensor.Valid(seen.z.data()) == Status::kOk) {
        features[feature].push_back({camera, 0, seen.z, true});
      } else {
        ++file.invalid;
      }
    }
  }
  for (auto& [feature, seen] : features) {
    const auto place = Triangulate(sensor, problem, seen);
    if (!place) {
      ++file.points_left_out;
      continue;
    }
    for (BundleObservation& one : seen) {
      one.point = static_cast<int>(problem.points.size());
      problem.observations.push_back(one);
    }
    problem.points.push_back(*place);
    file.point_ids.push_back(feature);
  }
  if (problem.cameras.empty()) {
    throw Error(ExitCode::kBadData,
                ErrorLine(Place{from.start.string()}, {}, "no pose at the time of any frame",
                          "the times of timestamps.csv beside the tracks"));
  }
  return file;
}

}  // namespace alidade
