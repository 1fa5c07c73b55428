// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>

#include "alidade/bundle/formats.h"
#include "alidade/model/geometry.h"

namespace alidade::internal {
namespace {

constexpr std::size_t kLens = 8;  // f, cx, cy, k1, k2, k3, p1, p2

/// Reader of 32-bit numbers in either byte order. The parameter `quantity` of a function is the
/// name of the value in error messages.
class BinaryReader {
 public:
  BinaryReader(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {
    const bool little = bytes_[0] == 'v';
    swap_ = little != (std::endian::native == std::endian::little);
    offset_ = 2;
  }
  std::int32_t Integer(const char* quantity) { return std::bit_cast<std::int32_t>(Word(quantity)); }
  double Number(const char* quantity) {
    const float value = std::bit_cast<float>(Word(quantity));
    if (!std::isfinite(value))
      Fail(offset_ - 4, std::string("a number of ") + quantity + " is not finite");
    return value;
  }
  void Numbers(const char* quantity, std::size_t count, double* values) {
    for (std::size_t i = 0; i < count; ++i) values[i] = Number(quantity);
  }
  int Count(const char* quantity) {
    const std::int32_t count = Integer(quantity);
    if (count < 0)
      Fail(offset_ - 4, std::string(quantity) + " is negative: " + std::to_string(count));
    return count;
  }
  void ExpectEnd() const {
    if (offset_ != bytes_.size()) Fail(offset_, "there are data after the last marker");
  }
  std::size_t offset() const { return offset_; }
  [[noreturn]] void Fail(std::size_t offset, const std::string& problem) const {
    throw Error(ExitCode::kBadData,
                ErrorLine(Place{name_}, {}, "byte " + std::to_string(offset) + ": " + problem));
  }

 private:
  std::uint32_t Word(const char* quantity) {
    if (bytes_.size() - offset_ < 4)
      Fail(bytes_.size(), std::string("the file ends before ") + quantity);
    std::uint32_t word = 0;
    std::memcpy(&word, bytes_.data() + offset_, 4);
    offset_ += 4;
    return swap_ ? __builtin_bswap32(word) : word;
  }

  std::string_view bytes_;
  std::string name_;
  std::size_t offset_ = 0;
  bool swap_ = false;
};

void ReadCamera(BinaryReader& bytes, BundleFile& file, std::map<std::int64_t, int>& index) {
  const std::size_t offset = bytes.offset();
  const std::int32_t image = bytes.Integer("the image of a camera");
  const auto number = static_cast<int>(file.problem.cameras.size());
  if (!index.emplace(image, number).second)
    bytes.Fail(offset, "there is a second camera for image " + std::to_string(image));
  std::vector<double> pose(12);
  bytes.Numbers("the rotation and translation of a camera", 12, pose.data());
  const Eigen::Map<const Eigen::Matrix3d> r(pose.data());  // column-major
  constexpr double kRounding = 1e-3;
  if (!(r * r.transpose()).isIdentity(kRounding) || !(r.determinant() > 0.0))
    bytes.Fail(offset + 4, "the 9 numbers that start here are not a rotation matrix");
  const Eigen::Quaterniond q{Eigen::Matrix3d(r)};
  const double wxyz[4] = {q.w(), q.x(), q.y(), q.z()};
  file.problem.cameras.push_back(CameraFromTransform(wxyz, pose.data() + 9, false));
  file.poses.push_back({file.problem.cameras.back(), pose});
  file.camera_ids.push_back(image);
}

void ReadPoint(BinaryReader& bytes, BundleFile& file, std::map<std::int64_t, int>& index) {
  const std::size_t offset = bytes.offset();
  const std::int32_t track = bytes.Integer("the track of a point");
  const auto number = static_cast<int>(file.problem.points.size());
  if (!index.emplace(track, number).second)
    bytes.Fail(offset, "there is a second point for track " + std::to_string(track));
  bytes.Numbers("a point", 3, file.problem.points.emplace_back().data());
  file.point_ids.push_back(track);
}

void AppendWord(std::string& bytes, std::uint32_t word) {
  if constexpr (std::endian::native == std::endian::big) word = __builtin_bswap32(word);
  char raw[4];
  std::memcpy(raw, &word, 4);
  bytes.append(raw, 4);
}
void AppendInteger(std::string& bytes, std::int64_t value) {
  AppendWord(bytes, static_cast<std::uint32_t>(value));
}
void AppendFloats(std::string& bytes, const double* values, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i)
    AppendWord(bytes, std::bit_cast<std::uint32_t>(static_cast<float>(values[i])));
}

}  // namespace

BundleFile ReadLibmv(std::string_view text, const std::string& name) {
  BinaryReader bytes(text, name);
  if (text[1] != 'P')
    bytes.Fail(1,
               "the markers are in normalised coordinates ('N'); expected markers in pixels ('P')");
  BundleFile file;
  file.format = BundleFormat::kLibmv;
  BundleProblem& problem = file.problem;
  problem.sensor = "{model: self_calibrating_feature, lens: radtan, sigma_px: 1}";
  problem.intrinsics.assign(1, std::vector<double>(kLens));
  bytes.Numbers("the intrinsics", kLens, problem.intrinsics[0].data());
  if (!(problem.intrinsics[0][0] > 0.0)) bytes.Fail(2, "the focal length is not positive");
  std::map<std::int64_t, int> cameras, points;
  const int camera_count = bytes.Count("the number of cameras");
  for (int i = 0; i < camera_count; ++i) ReadCamera(bytes, file, cameras);
  const int point_count = bytes.Count("the number of points");
  for (int i = 0; i < point_count; ++i) ReadPoint(bytes, file, points);
  const int marker_count = bytes.Count("the number of markers");
  for (int i = 0; i < marker_count; ++i) {
    const std::size_t offset = bytes.offset();
    const auto camera = cameras.find(bytes.Integer("the image of a marker"));
    const auto point = points.find(bytes.Integer("the track of a marker"));
    if (camera == cameras.end()) bytes.Fail(offset, "the image of the marker has no camera");
    if (point == points.end()) bytes.Fail(offset + 4, "the track of the marker has no point");
    BundleObservation& observation = problem.observations.emplace_back();
    observation.camera = camera->second;
    observation.point = point->second;
    bytes.Numbers("a marker", 2, observation.z.data());
  }
  bytes.ExpectEnd();
  return file;
}

std::string LibmvBytes(const BundleFile& file) {
  const BundleProblem& problem = file.problem;
  std::string bytes = "vP";
  AppendFloats(bytes, problem.intrinsics[0].data(), kLens);
  AppendInteger(bytes, std::ssize(problem.cameras));
  for (std::size_t i = 0; i < problem.cameras.size(); ++i) {
    AppendInteger(bytes, file.camera_ids[i]);
    double pose[12], q[4];
    if (const double* const numbers = UnmovedNumbers(file, i)) {
      std::copy_n(numbers, 12, pose);
    } else {
      TransformFromCamera(problem.cameras[i], false, q, pose + 9);
      Eigen::Map<Eigen::Matrix3d>{pose} =
          Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
    }
    AppendFloats(bytes, pose, 12);
  }
  AppendInteger(bytes, std::ssize(problem.points));
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    AppendInteger(bytes, file.point_ids[i]);
    AppendFloats(bytes, problem.points[i].data(), 3);
  }
  AppendInteger(bytes, std::ssize(problem.observations));
  for (const BundleObservation& observation : problem.observations) {
    AppendInteger(bytes, file.camera_ids[static_cast<std::size_t>(observation.camera)]);
    AppendInteger(bytes, file.point_ids[static_cast<std::size_t>(observation.point)]);
    AppendFloats(bytes, observation.z.data(), 2);
  }
  return bytes;
}

}  // namespace alidade::internal
