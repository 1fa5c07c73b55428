// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/pose_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "alidade/base/number_text.h"

namespace alidade::internal {
namespace {

constexpr const char* kHeader = "# t x y z qx qy qz qw";
constexpr const char* kCovariances = " Pr11 Pr12 Pr13 Pr22 Pr23 Pr33 Pt11 Pt12 Pt13 Pt22 Pt23 Pt33";

constexpr std::array<std::string_view, 5> kAngles = {"orientation", "heading", "yaw", "angle",
                                                     "theta"};

/// Extends a planar covariance to three axes with zeros. The planar covariance is 2x2 for a
/// position and 1x1 for an angle.
Eigen::Matrix3d ExpandToThreeAxes(const Eigen::MatrixXd& covariance) {
  if (covariance.rows() == 3) return covariance;
  Eigen::Matrix3d expanded = Eigen::Matrix3d::Zero();
  if (covariance.rows() == 2) {
    expanded.topLeftCorner<2, 2>() = covariance;
  } else {
    expanded(2, 2) = covariance(0, 0);
  }
  return expanded;
}

void AppendUpper(std::string& row, const Eigen::MatrixXd& covariance) {
  const Eigen::Matrix3d expanded = ExpandToThreeAxes(covariance);
  const bool finite = expanded.allFinite();
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) {
      row += ' ';
      AppendNumber(row, finite ? expanded(i, j) : 0.0);
    }
  }
}

/// Returns true if `value` has `size` numbers, and its name is `prefix` followed by the name of an
/// orientation.
bool IsOrientation(const StreamInfo& value, const std::string& prefix, int size) {
  if (value.size != size || !value.name.starts_with(prefix)) return false;
  const std::string_view name = std::string_view(value.name).substr(prefix.size());
  return size == 4 ? name == kAngles[0] : std::ranges::find(kAngles, name) != kAngles.end();
}

}  // namespace

std::optional<PosePlace> FindPose(const std::vector<StreamInfo>& values) {
  constexpr std::string_view kPosition = "position";
  for (std::size_t p = 0; p < values.size(); ++p) {
    const std::string& name = values[p].name;
    if (values[p].size != 2 && values[p].size != 3) continue;
    if (name != kPosition && !name.ends_with('.' + std::string(kPosition))) continue;
    const bool planar = values[p].size == 2;
    const std::string prefix = name.substr(0, name.size() - kPosition.size());
    const auto found = std::ranges::find_if(values, [&](const StreamInfo& value) {
      return IsOrientation(value, prefix, planar ? 1 : 4);
    });
    if (found == values.end()) continue;
    return PosePlace{p, static_cast<std::size_t>(found - values.begin()), planar};
  }
  return std::nullopt;
}

PoseFile::PoseFile(const OutputFolder& folder, const std::string& name, const PosePlace& place,
                   bool with_covariances)
    : place_(place), file_(folder.Create(name)) {
  file_->Write(std::string(kHeader) + (with_covariances ? kCovariances : "") + '\n');
}

void PoseFile::AppendPose(std::string& row, Timestamp timestamp, const double* position,
                          const double* orientation) const {
  Eigen::Vector3d r = Eigen::Vector3d::Zero();
  Eigen::Vector4d q = Eigen::Vector4d::Zero();  // order: w x y z
  if (place_.planar) {
    r.head<2>() << position[0], position[1];
    q << std::cos(0.5 * orientation[0]), 0.0, 0.0, std::sin(0.5 * orientation[0]);
  } else {
    r << position[0], position[1], position[2];
    q << orientation[0], orientation[1], orientation[2], orientation[3];
  }
  AppendSeconds(row, timestamp);
  for (const double value : {r[0], r[1], r[2], q[1], q[2], q[3], q[0]}) {
    row += ' ';
    AppendNumber(row, value);
  }
}

void PoseFile::Add(Timestamp timestamp, const double* position, const double* orientation) {
  std::string row;
  AppendPose(row, timestamp, position, orientation);
  file_->Write(row + '\n');
}

void PoseFile::Add(Timestamp timestamp, const double* position, const double* orientation,
                   const Eigen::MatrixXd& position_covariance,
                   const Eigen::MatrixXd& orientation_covariance) {
  std::string row;
  AppendPose(row, timestamp, position, orientation);
  AppendUpper(row, orientation_covariance);
  AppendUpper(row, position_covariance);
  file_->Write(row + '\n');
}

void PoseFile::AddTruth(const SourceFrame& frame) {
  if (frame.truth.size() <= std::max(place_.position, place_.orientation)) return;
  const std::vector<double>& r = frame.truth[place_.position];
  const std::vector<double>& q = frame.truth[place_.orientation];
  if (!r.empty() && !q.empty()) Add(frame.timestamp, r.data(), q.data());
}

void PoseFile::Close() { file_->Close(); }

}  // namespace alidade::internal
