// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <tuple>
#include <vector>

#include "alidade/filter/ekf.h"
#include "alidade/filter/ekf_landmarks.h"

namespace alidade {

/// What passes from frame to frame.
struct Ekf::Kept : Snapshot {
  /// All but the state and the map.
  static auto Members(auto& ekf) {
    return std::tie(ekf.timestamp_, ekf.inputs_, ekf.most_parts_, ekf.first_, ekf.rejections_,
                    ekf.out_of_domain_, ekf.inflated_, ekf.warned_, ekf.repairs_, ekf.last_used_,
                    ekf.diverged_, ekf.failed_);
  }
  explicit Kept(const Ekf& ekf) : Snapshot(ekf.state_), values(Members(ekf)) {
    if (ekf.landmarks_ != nullptr) landmarks = ekf.landmarks_->map();
    interval_steps = ekf.interval_steps_;
    for (const MotionPlan& plan : ekf.motions_) {
      held.push_back(plan.holds ? Held{plan.l, plan.gl, plan.m} : Held{});
    }
  }
  /// Into the plans, once they are bound.
  void RestoreInterval(Ekf& ekf) const {
    ekf.interval_steps_ = interval_steps;
    for (std::size_t i = 0; i < held.size(); ++i) {
      MotionPlan& plan = ekf.motions_[i];
      if (plan.holds)
        std::tie(plan.l, plan.gl, plan.m) = std::tie(held[i].l, held[i].gl, held[i].m);
    }
  }

  /// The noise that a motion model holds.
  struct Held {
    std::vector<double> l, gl, m;
  };

  std::tuple<Timestamp, ControlInputs, Timestamp, std::vector<std::vector<double>>,
             std::vector<int>, std::vector<char>, std::vector<char>, std::vector<bool>, int,
             decltype(last_used_), bool, bool>
      values;
  LandmarkMap landmarks;
  Timestamp interval_steps = 0;
  std::vector<Held> held;  ///< by motion
};

}  // namespace alidade
