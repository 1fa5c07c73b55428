// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/record/column_tables.h"

namespace alidade {

/// Observer that writes each estimate immediately, as a line of JSON for each frame and estimator.
/// The keys are `t_s` and `estimator`, followed by `owner.block.element` and
/// `sigma:owner.block.element` for each block that has a value. The estimates of an offline
/// estimator are written after the last frame.
class Follower : public RunObserver {
 public:
  /// Calls `write` with each line, including the line end.
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
