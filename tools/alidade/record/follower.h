// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/record/column_tables.h"

namespace alidade {

/// Observer that writes each estimate immediately, as a line of JSON for each frame and estimator:
/// `t_s`, `estimator`, then `owner.block.element` and `sigma:owner.block.element` of the problem's
/// blocks that have a value. An offline estimator writes its estimates after the last frame.
class Follower : public RunObserver {
 public:
  /// Calls `write` with each line, including its line end.
  explicit Follower(std::function<void(std::string_view line)> write) : write_(std::move(write)) {}

  void Begin(const Experiment& experiment) override;
  void OnEstimate(int estimator, const SourceFrame& frame, const State& state,
                  const UpdateReport& report) override;

 private:
  struct FollowedEstimator {
    std::string name;
    std::vector<internal::BlockLayout> blocks;
  };
  std::function<void(std::string_view line)> write_;
  std::vector<FollowedEstimator> estimators_;
};

}  // namespace alidade
