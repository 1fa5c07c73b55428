// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/estimation/problem.h"
#include "alidade/experiment/run.h"

namespace alidade {

/// Writes each estimate as it is made, a line of JSON for each frame and estimator: `t_s`,
/// `estimator`, then `owner.block.element` and `sigma:owner.block.element` of the blocks of the
/// system that have a value. An offline estimator has none until all frames are there.
class Follower : public RunObserver {
 public:
  /// `write` takes a line with its end.
  explicit Follower(std::function<void(std::string_view line)> write) : write_(std::move(write)) {}

  void Begin(const Experiment& experiment) override;
  void OnEstimate(int estimator, const SourceFrame& frame, const State& state,
                  const UpdateReport& report) override;

 private:
  struct Followed {
    std::string name;
    StateLayout layout;  ///< of its problem
  };
  std::function<void(std::string_view line)> write_;
  std::vector<Followed> estimators_;
};

}  // namespace alidade
