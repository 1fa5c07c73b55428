// SPDX-License-Identifier: Apache-2.0
#include "pose_file.h"

#include <algorithm>

#include "number_text.h"

namespace alidade::internal {
namespace {

constexpr const char* kHeader = "# t x y z qx qy qz qw";
constexpr const char* kCovariances = " Pr11 Pr12 Pr13 Pr22 Pr23 Pr33 Pt11 Pt12 Pt13 Pt22 Pt23 Pt33";

void AppendPose(std::string& row, Stamp stamp, const double* r, const double* q) {
  AppendSeconds(row, stamp);
  for (const double value : {r[0], r[1], r[2], q[1], q[2], q[3], q[0]}) {
    row += ' ';
    AppendNumber(row, value);
  }
}

void AppendUpper(std::string& row, const Eigen::Matrix3d& covariance) {
  const bool finite = covariance.allFinite();
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) {
      row += ' ';
      AppendNumber(row, finite ? covariance(i, j) : 0.0);
    }
  }
}

}  // namespace

std::optional<PosePlace> FindPose(const std::vector<StreamInfo>& values) {
  constexpr std::string_view kPosition = ".position";
  for (std::size_t p = 0; p < values.size(); ++p) {
    const std::string& name = values[p].name;
    if (values[p].size != 3 || !name.ends_with(kPosition)) continue;
    const std::string other = name.substr(0, name.size() - kPosition.size()) + ".orientation";
    const auto is_other = [&](const StreamInfo& v) { return v.size == 4 && v.name == other; };
    const auto found = std::ranges::find_if(values, is_other);
    if (found == values.end()) continue;
    return PosePlace{p, static_cast<std::size_t>(found - values.begin())};
  }
  return std::nullopt;
}

PoseFile::PoseFile(const RunFolder& folder, const std::string& name, bool with_covariances)
    : file_(folder.Create(name)) {
  file_->Write(std::string(kHeader) + (with_covariances ? kCovariances : "") + '\n');
}

void PoseFile::Add(Stamp stamp, const double* position, const double* orientation) {
  std::string row;
  AppendPose(row, stamp, position, orientation);
  file_->Write(row + '\n');
}

void PoseFile::Add(Stamp stamp, const double* position, const double* orientation,
                   const Eigen::Matrix3d& position_covariance,
                   const Eigen::Matrix3d& orientation_covariance) {
  std::string row;
  AppendPose(row, stamp, position, orientation);
  AppendUpper(row, orientation_covariance);
  AppendUpper(row, position_covariance);
  file_->Write(row + '\n');
}

void PoseFile::AddTruth(const Frame& frame, const PosePlace& place) {
  if (frame.truth.size() <= std::max(place.position, place.orientation)) return;
  const std::vector<double>& r = frame.truth[place.position];
  const std::vector<double>& q = frame.truth[place.orientation];
  if (!r.empty() && !q.empty()) Add(frame.stamp, r.data(), q.data());
}

void PoseFile::Close() { file_->Close(); }

}  // namespace alidade::internal
