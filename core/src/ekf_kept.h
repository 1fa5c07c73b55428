// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/ekf.h"
#include "ekf_landmarks.h"

namespace alidade {

/// What passes from frame to frame besides the state.
struct Ekf::Kept : Snapshot {
  explicit Kept(const Ekf& ekf)
      : Snapshot(ekf.state_),
        stamp(ekf.stamp_),
        first(ekf.first_),
        rejections(ekf.rejections_),
        out_of_domain(ekf.out_of_domain_),
        inflated(ekf.inflated_),
        warned(ekf.warned_),
        last_used(ekf.last_used_),
        diverged(ekf.diverged_),
        failed(ekf.failed_) {
    if (ekf.landmarks_ != nullptr) landmarks = ekf.landmarks_->map();
  }

  Stamp stamp;
  std::vector<std::vector<double>> first;
  std::vector<int> rejections;
  std::vector<char> out_of_domain, inflated;
  std::vector<bool> warned;
  decltype(last_used_) last_used;
  bool diverged, failed;
  LandmarkMap landmarks;
};

}  // namespace alidade
