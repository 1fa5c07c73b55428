// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <algorithm>

#include "alidade/base/number_text.h"
#include "alidade/bundle/cursor.h"
#include "alidade/bundle/formats.h"
#include "alidade/model/geometry.h"

namespace alidade::internal {
namespace {

constexpr std::int64_t kMaxIndex = INT32_MAX;
/// Quaternion of the rotation by pi about x, which is its own inverse. It converts between a frame
/// with y up and -z ahead and a frame with y down and +z ahead.
constexpr double kHalfTurn[4] = {0, 1, 0, 0};
/// Sensor of the formats BAL and Bundler. Both formats project by p = -P / P_z for either sign of
/// P_z, so the domain is projective.
const char* const kRadial =
    "{model: self_calibrating_feature, lens: radial, domain: projective, sigma_px: 1}";

void AppendLine(std::string& text, const double* values, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 0) text += ' ';
    AppendNumber(text, values[i]);
  }
  text += '\n';
}

/// Returns the pose of camera i as the 6 numbers of a BAL file: angle-axis vector and t.
std::array<double, 6> BalPose(const BundleFile& file, std::size_t i) {
  std::array<double, 6> pose;
  if (const double* const numbers = UnmovedNumbers(file, i)) {
    std::copy_n(numbers, 6, pose.data());
  } else {
    double q[4];
    TransformFromCamera(file.problem.cameras[i], true, q, pose.data() + 3);
    UnitQuaternion::Log(q, pose.data());
  }
  return pose;
}

/// Returns the pose of camera i as the 12 numbers of a Bundler file: R (row-major) and t.
std::array<double, 12> BundlerPose(const BundleFile& file, std::size_t i) {
  std::array<double, 12> pose;
  if (const double* const numbers = UnmovedNumbers(file, i)) {
    std::copy_n(numbers, 12, pose.data());
  } else {
    double q[4];
    TransformFromCamera(file.problem.cameras[i], true, q, pose.data() + 9);
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>{pose.data()} =
        Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
  }
  return pose;
}

/// Reads f, k1 and k2. If `may_be_missing` is true, f = 0 is accepted. This value marks an image
/// that is not registered.
void ReadLens(BundleCursor& cursor, bool may_be_missing, double* lens) {
  lens[0] = cursor.Number("focal length of a camera");
  if (!(lens[0] > 0.0) && !(may_be_missing && lens[0] == 0.0))
    cursor.Fail("the focal length is not positive", "a positive number in px");
  cursor.Numbers("k1, k2 of a camera", 2, lens + 1);
}

/// Reads one camera of a Bundler file.
void ReadBundlerCamera(BundleCursor& cursor, BundleFile& file) {
  BundleProblem& problem = file.problem;
  std::vector<double> lens(3), pose(12);
  ReadLens(cursor, true, lens.data());
  cursor.Numbers("rotation of a camera", 9, pose.data());
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> r(pose.data());
  const bool missing = lens[0] == 0.0 && r.isZero();  // the image is not registered
  constexpr double kRounding = 1e-3;
  if (!missing && (!(r * r.transpose()).isIdentity(kRounding) || !(r.determinant() > 0.0)))
    cursor.Fail("the 9 numbers that end here are not a rotation matrix",
                "an orthonormal matrix with the determinant 1");
  cursor.Numbers("translation of a camera", 3, pose.data() + 9);
  const Eigen::Quaterniond q =
      missing ? Eigen::Quaterniond::Identity() : Eigen::Quaterniond(Eigen::Matrix3d(r));
  const double wxyz[4] = {q.w(), q.x(), q.y(), q.z()};
  problem.cameras.push_back(CameraFromTransform(wxyz, pose.data() + 9, true));
  problem.cameras.back().intrinsics = static_cast<int>(problem.intrinsics.size());
  problem.intrinsics.push_back(lens);
  file.poses.push_back({problem.cameras.back(), pose, !missing});
}

/// Reads one point of a Bundler file with its observations.
void ReadBundlerPoint(BundleCursor& cursor, int point, BundleFile& file) {
  BundleProblem& problem = file.problem;
  cursor.Numbers("a point", 3, problem.points.emplace_back().data());
  std::string colour;
  for (int i = 0; i < 3; ++i) colour += (i > 0 ? " " : "") + std::string(cursor.Word("a colour"));
  file.colours.push_back(colour);
  const auto cameras = static_cast<std::int64_t>(problem.cameras.size());
  const int views = cursor.Index("a number of views", cameras + 1);
  for (int i = 0; i < views; ++i) {
    BundleObservation& observation = problem.observations.emplace_back();
    observation.camera = cursor.Index("a camera", cameras);
    observation.point = point;
    const auto lens = static_cast<std::size_t>(observation.camera);
    if (problem.intrinsics[lens][0] == 0.0)
      cursor.Fail("the observed camera is not registered", "a camera whose focal length is not 0");
    file.keys.push_back(cursor.Index("a key", kMaxIndex));
    observation.z[0] = cursor.Number("u");
    observation.z[1] = -cursor.Number("v");
  }
}

}  // namespace

BundleCamera CameraFromTransform(const double* q, const double* t, bool looks_back) {
  BundleCamera camera;
  const double inverse[4] = {q[0], -q[1], -q[2], -q[3]};
  UnitQuaternion::Rotate(inverse, t, camera.position.data());
  for (double& x : camera.position) x = 0.0 - x;  // 0.0 - x is never -0
  if (looks_back) {
    UnitQuaternion::Multiply(inverse, kHalfTurn, camera.orientation.data());
  } else {
    std::copy_n(inverse, 4, camera.orientation.data());
  }
  UnitQuaternion::Normalise(camera.orientation.data());
  for (double& x : camera.orientation) x += 0.0;
  return camera;
}

void TransformFromCamera(const BundleCamera& camera, bool looks_back, double* q, double* t) {
  const auto& o = camera.orientation;
  const double inverse[4] = {o[0], -o[1], -o[2], -o[3]};
  if (looks_back) {
    UnitQuaternion::Multiply(kHalfTurn, inverse, q);
  } else {
    std::copy_n(inverse, 4, q);
  }
  UnitQuaternion::Rotate(q, camera.position.data(), t);
  for (int i = 0; i < 3; ++i) t[i] = -t[i];
}

const double* UnmovedNumbers(const BundleFile& file, std::size_t i) {
  if (i >= file.poses.size()) return nullptr;
  const BundleCamera& camera_in_file = file.poses[i].camera;
  const BundleCamera& camera = file.problem.cameras[i];
  const bool unmoved = camera_in_file.position == camera.position &&
                       camera_in_file.orientation == camera.orientation;
  return unmoved ? file.poses[i].numbers.data() : nullptr;
}

BundleFile ReadBal(std::string_view text, const std::string& name) {
  BundleCursor cursor(text, name);
  BundleFile file;
  BundleProblem& problem = file.problem;
  problem.sensor = kRadial;
  const int cameras = cursor.Index("the number of cameras", kMaxIndex);
  const int points = cursor.Index("the number of points", kMaxIndex);
  const int observations = cursor.Index("the number of observations", kMaxIndex);
  for (int i = 0; i < observations; ++i) {
    BundleObservation& observation = problem.observations.emplace_back();
    observation.camera = cursor.Index("the camera of an observation", cameras);
    observation.point = cursor.Index("the point of an observation", points);
    observation.z[0] = cursor.Number("u of an observation");
    observation.z[1] = -cursor.Number("v of an observation");
  }
  for (int i = 0; i < cameras; ++i) {
    std::vector<double> pose(6), lens(3);
    cursor.Numbers("rotation and translation of a camera", 6, pose.data());
    ReadLens(cursor, false, lens.data());
    double q[4];
    UnitQuaternion::Exp(pose.data(), q);
    problem.cameras.push_back(CameraFromTransform(q, pose.data() + 3, true));
    problem.cameras.back().intrinsics = i;
    problem.intrinsics.push_back(lens);
    file.poses.push_back({problem.cameras.back(), pose});
  }
  for (int i = 0; i < points; ++i)
    cursor.Numbers("a point", 3, problem.points.emplace_back().data());
  cursor.ExpectEnd("the end of the file after the last point");
  return file;
}

std::string BalText(const BundleFile& file) {
  const BundleProblem& problem = file.problem;
  std::string text = std::to_string(problem.cameras.size()) + ' ' +
                     std::to_string(problem.points.size()) + ' ' +
                     std::to_string(problem.observations.size()) + '\n';
  for (const BundleObservation& observation : problem.observations) {
    text += std::to_string(observation.camera) + ' ' + std::to_string(observation.point) + ' ';
    const double uv[2] = {observation.z[0], -observation.z[1]};
    AppendLine(text, uv, 2);
  }
  const auto append_lines = [&](const double* values, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) AppendLine(text, values + i, 1);
  };
  for (std::size_t i = 0; i < problem.cameras.size(); ++i) {
    const auto lens = static_cast<std::size_t>(problem.cameras[i].intrinsics);
    append_lines(BalPose(file, i).data(), 6);
    append_lines(problem.intrinsics[lens].data(), 3);
  }
  for (const auto& point : problem.points) append_lines(point.data(), 3);
  return text;
}

BundleFile ReadBundler(std::string_view text, const std::string& name) {
  BundleCursor cursor(text, name);
  BundleFile file;
  file.format = BundleFormat::kBundler;
  file.problem.sensor = kRadial;
  cursor.SkipLine();  // skips the header
  const int cameras = cursor.Index("the number of cameras", kMaxIndex);
  const int points = cursor.Index("the number of points", kMaxIndex);
  for (int i = 0; i < cameras; ++i) ReadBundlerCamera(cursor, file);
  for (int i = 0; i < points; ++i) ReadBundlerPoint(cursor, i, file);
  cursor.ExpectEnd("the end of the file after the last point");
  return file;
}

std::string BundlerText(const BundleFile& file) {
  const BundleProblem& problem = file.problem;
  std::string text(kBundlerHeader);
  text += '\n' + std::to_string(problem.cameras.size()) + ' ' +
          std::to_string(problem.points.size()) + '\n';
  for (std::size_t i = 0; i < problem.cameras.size(); ++i) {
    const std::array<double, 12> pose = BundlerPose(file, i);
    const auto lens = static_cast<std::size_t>(problem.cameras[i].intrinsics);
    AppendLine(text, problem.intrinsics[lens].data(), 3);
    for (std::size_t row = 0; row < 4; ++row) AppendLine(text, pose.data() + 3 * row, 3);
  }
  std::size_t next = 0;  // observations are in the order of their points
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    AppendLine(text, problem.points[i].data(), 3);
    text += file.colours[i] + '\n';
    std::string views;
    std::size_t count = 0;
    for (; next < problem.observations.size(); ++next, ++count) {
      const BundleObservation& observation = problem.observations[next];
      if (static_cast<std::size_t>(observation.point) != i) break;
      views += ' ' + std::to_string(observation.camera) + ' ' + std::to_string(file.keys[next]) +
               ' ' + NumberText(observation.z[0]) + ' ' + NumberText(-observation.z[1]);
    }
    text += std::to_string(count) + views + '\n';
  }
  return text;
}

}  // namespace alidade::internal
