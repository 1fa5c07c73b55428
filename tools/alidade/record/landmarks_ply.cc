// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/landmarks_ply.h"

#include <cstdint>

#include "alidade/base/number_text.h"

namespace alidade::internal {

std::string LandmarksPly(const std::vector<LandmarkEstimate>& landmarks) {
  std::string vertices;
  std::int64_t count = 0;
  for (const LandmarkEstimate& landmark : landmarks) {
    const Eigen::Vector3d sigma = landmark.covariance.diagonal().cwiseSqrt();
    if (!landmark.position.allFinite() || !sigma.allFinite()) continue;
    ++count;
    for (const double x : landmark.position) vertices += NumberText(x) + ' ';
    for (const double x : sigma) vertices += NumberText(x) + ' ';
    vertices +=
        (landmark.removed != kNoTimestamp ? "1 " : "0 ") + std::to_string(landmark.id) + '\n';
  }
  std::string text = "ply\nformat ascii 1.0\ncomment landmarks in the world, m\nelement vertex " +
                     std::to_string(count) + '\n';
  for (const char* name : {"x", "y", "z", "sigma_x", "sigma_y", "sigma_z"}) {
    text += std::string("property double ") + name + '\n';
  }
  return text + "property uchar removed\nproperty double id\nend_header\n" + vertices;
}

}  // namespace alidade::internal
