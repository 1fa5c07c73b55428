// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "alidade/compare/over_runs.h"
#include "alidade/run/run.h"

namespace alidade::internal {

/// Follows the errors of one estimator of a run. Of a long run every n-th timestamp is kept, n a
/// power of two, so that memory does not grow with it.
class ErrorRecorder {
 public:
  static constexpr std::size_t kMost = 2048;  ///< timestamps

  ErrorRecorder(const NamedEstimator& named, const Experiment& experiment);
  void Add(const SourceFrame& frame, const State& state);
  ErrorSeries Take() { return std::move(series_); }

 private:
  /// A block with truth; its error at the timestamp at hand.
  struct Tracked {
    BlockId id;
    std::size_t truth, owner;
    double truth_variance;
    Eigen::VectorXd error = {};
    bool known = false;
  };

  /// Leaves out every other row.
  void Thin();

  ErrorSeries series_;
  std::vector<Tracked> tracked_;
  std::size_t count_ = 0, stride_ = 1;
};

}  // namespace alidade::internal
