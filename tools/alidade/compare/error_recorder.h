// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "alidade/compare/over_seeds.h"
#include "alidade/experiment/cramer_rao.h"
#include "alidade/experiment/run.h"

namespace alidade::internal {

/// Recorder of the errors of one estimator during a run. For an online estimator, the recorder also
/// records the CramerRaoBound, a lower bound of the mean square error of any online estimator. To
/// limit the memory in a long run, only every n-th timestamp is retained, with n a power of two.
class ErrorRecorder {
 public:
  static constexpr std::size_t kMaxTimestamps = 2048;

  ErrorRecorder(const EstimatorSpec& spec, const Experiment& experiment);
  void Add(const SourceFrame& frame, const State& state);
  /// Returns the recorded errors and the mean ratios to the bound. Call this function once, after
  /// the run.
  ErrorSeries Finish();

 private:
  /// Block with a truth, and the error of the block at the current timestamp.
  struct TrackedBlock {
    BlockId id;
    std::size_t truth, owner;
    double truth_variance, prior_sigma;
    Eigen::VectorXd error = {};
    bool has_error = false;
    double bound = 0.0;            ///< trace of the bound P of the block
    double sum_by_bound = 0.0;     ///< sum of |e|^2 / tr P over the timestamps with both values
    std::int64_t bound_count = 0;  ///< number of timestamps in the sum
  };

  /// Updates the bound. Returns false if the bound is undefined from this frame on.
  bool AddBound(const SourceFrame& frame);
  /// Appends the current timestamp to the series.
  void AppendTimestamp(Timestamp timestamp, const State& state);
  /// Removes every second row of the series.
  void RemoveOddRows();

  ErrorSeries series_;
  std::vector<TrackedBlock> blocks_;
  std::optional<CramerRaoBound> bound_;
  std::size_t count_ = 0, stride_ = 1;
};

}  // namespace alidade::internal
